"""The data sheets of torque drives: delay, limits, errors, and the torque that they report."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

from .sheets import PER_AXIS, Numbers, Sizes

Limit = Annotated[float, Field(ge=0.0, le=1e9)]


class CommandDelaySettings(StrictModel):
    """Settings of the delay of commands."""

    command_latency_ticks: Annotated[int, Field(ge=0, le=1000)] = Field(
        0, description="delay of commands, ticks"
    )


class TorqueLimitSettings(StrictModel):
    """Settings of the torque limits."""

    base_torque_limit: Limit = Field(
        0.0, description="largest torque on each axis of an ideal base, N m (0: no limit)"
    )
    joint_torque_limit: Limit = Field(
        0.0, description="largest torque on each joint, N m or N (0: no limit)"
    )


class DriveSettings(StrictModel):
    """Errors of torque drives; by default none."""

    drive_scale: Numbers = Field(
        [1.0], description=f"applied torque divided by commanded torque; {PER_AXIS}"
    )
    drive_bias: Numbers = Field([0.0], description=f"torque that the drive adds, N m; {PER_AXIS}")
    drive_lag: Sizes = Field(
        [0.0], description=f"time constant of the drive's lag, s (0: none); {PER_AXIS}"
    )
    drive_step: Sizes = Field(
        [0.0], description=f"resolution of the torque, N m (0: continuous); {PER_AXIS}"
    )
    drive_dead_band: Sizes = Field(
        [0.0], description=f"torque below which the drive applies none, N m; {PER_AXIS}"
    )


class TorqueEchoSettings(StrictModel):
    """Settings of the reported torque."""

    torque_echo: Literal["command", "given"] = Field(
        "command",
        description="torque that is reported as applied: command (the commanded torque within its "
        "limits) or given (the torque that acts on the robot)",
    )
    echo_scale: Numbers = Field(
        [1.0], description=f"reported torque divided by that of torque_echo; {PER_AXIS}"
    )
    echo_bias: Numbers = Field([0.0], description=f"torque added to the report, N m; {PER_AXIS}")
