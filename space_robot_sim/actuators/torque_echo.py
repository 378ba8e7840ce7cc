"""Reported torque: the applied torque as the flight software receives it.

    reported = scale * source + bias

The source is the command within its limits, as a drive's computer has it, or the torque that is
given, as a sensor on the shaft has it. A time-delay estimate is made of this echo, so its scale is
critical: under ``reported = b * command``, ``given = a * command`` the error of the estimate obeys
``b E - a H_S^-1 H_bar`` in place of ``E - H_S^-1 H_bar``, which grows where b exceeds 1 by more
than the smallest eigenvalue of ``a H_S^-1 H_bar``. What the drives give (a) matters less.
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.hardware.per_axis import PER_AXIS, Numbers, per_axis
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import all_lanes, uniform, where
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.config.validation import StrictModel

from ..faults.axes import About
from ..faults.grammar import Argument, Kind
from ..faults.schedule import Schedule, ScheduledFault, TemporaryChange

Array = NDArray[np.float64]


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


class TorqueEcho(Record):
    """Report of torques, one per axis: base x, y, z (base frame), then joints."""

    is_of_given: float = shaped(lambda n: (), uniform=True)
    """1 if the torque given is reported, 0 if the command within its limits is."""
    scale: Array = shaped(lambda n: (n + 3,))
    """Reported torque per torque of the source."""
    bias: Array = shaped(lambda n: (n + 3,))
    """N m."""
    is_exact: float = shaped(lambda n: ())
    """1 if the source itself is reported, so that the kernel is skipped; see `judge`."""

    @classmethod
    def build(cls, n: int, settings: TorqueEchoSettings) -> TorqueEcho:
        """Read the settings for a robot of ``n`` joints.

        Raises:
            InputError: see `per_axis`.
        """
        echo = cls.allocate(n)
        assign(
            echo,
            is_of_given=settings.torque_echo == "given",
            scale=per_axis(settings, "echo_scale", n),
            bias=per_axis(settings, "echo_bias", n),
        )
        judge(echo)
        return echo


def judge(echo: TorqueEcho) -> None:
    """Update ``is_exact``; to be called after any parameter has changed."""
    assign(echo, is_exact=not np.any((echo.scale - 1.0, echo.bias)))


@kernel
def report_torque(echo: TorqueEcho, applied: Array, reported: Array) -> None:
    """Write into ``reported`` (n+3,) the report on ``applied`` (n+3,), N m.

    ``reported`` holds the command within its limits before.
    """
    is_exact, is_of_command = echo.is_exact != 0.0, uniform(echo.is_of_given) == 0.0
    if is_of_command and all_lanes(is_exact):
        return
    for i in range(applied.size):
        source = reported[i] if is_of_command else applied[i]
        reported[i] = where(is_exact, source, echo.scale[i] * source + echo.bias[i])


TORQUE_SCALE = Kind(
    "torque_scale",
    Argument("FACTOR", "1", 1e-3, 1e3, about=About.AXIS),
    None,
    "the applied torque is FACTOR times the reported torque",
)
TORQUE_BIAS = Kind(
    "torque_bias",
    Argument("TORQUE", "N m", -1e6, 1e6, about=About.AXIS),
    None,
    "the applied torque is TORQUE plus the reported torque",
)


class WrongEcho:
    """Fault: some axes report a wrong torque for a while; the given torque is correct."""

    KINDS: ClassVar[tuple[Kind, ...]] = (TORQUE_SCALE, TORQUE_BIAS)

    def __init__(self, schedule: Schedule) -> None:
        self._scale = TemporaryChange(schedule.of(TORQUE_SCALE))
        self._bias = TemporaryChange(schedule.of(TORQUE_BIAS))

    def apply(self, tick: int, part: TorqueEcho) -> None:
        """Apply the faults of the report from ``tick`` to the next."""
        is_scaled = self._scale.apply(tick, part.scale, _divide)
        if self._bias.apply(tick, part.bias, _subtract) or is_scaled:
            judge(part)


def _divide(scale: Array, fault: ScheduledFault) -> None:
    scale[list(fault.axes)] /= fault.value


def _subtract(bias: Array, fault: ScheduledFault) -> None:
    bias[list(fault.axes)] -= fault.value
