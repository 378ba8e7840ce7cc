"""The data sheet of torque drives."""

from __future__ import annotations

from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

from .per_axis import PER_AXIS, Numbers, Sizes


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
