"""Errors of the drives between commanded and given torque.

A torque ``u`` that has passed the limits is given as the following, axis by axis:

    u -> [quantisation -> dead band] -> lag -> [scale, bias] -> given

Quantisation gives whole steps, ``step * floor(u / step + 1/2)``; the dead band gives nothing for
less than its width, and the rest as it is. The lag is of first order, ``tau dy/dt + y = u``. Under
a ``u`` held over a tick T its exact response from ``y_0`` is ``u + (y_0 - u) exp(-t / tau)``; what
is given over the tick is the mean of that, so the angular momentum that it brings is exact:

    mean = u + (y_0 - u) tau / T (1 - exp(-T / tau)),    y_1 = u + (y_0 - u) exp(-T / tau)

A scale error multiplies and a bias is added last, as errors of a drive's amplifier do.
"""

from __future__ import annotations

from decimal import Decimal
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.functions import in_steps
from space_robot_model.hardware.drives import DriveSettings
from space_robot_model.hardware.per_axis import per_axis
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import all_lanes, any_lane, where
from space_robot_msgs_py.compiled.records import Record, assign, shaped

from ..faults.axes import About
from ..faults.grammar import Argument, Kind
from ..faults.schedule import Schedule, ScheduledFault, TemporaryChange

Array = NDArray[np.float64]


class Drive(Record):
    """The drives of one robot, an axis each: base x, y, z (base frame), then joints."""

    scale: Array = shaped(lambda n: (n + 3,))
    """Torque given per torque commanded."""
    bias: Array = shaped(lambda n: (n + 3,))
    """N m."""
    step: Array = shaped(lambda n: (n + 3,))
    """N m; 0: any torque can be given."""
    dead_band: Array = shaped(lambda n: (n + 3,))
    """N m."""
    decay: Array = shaped(lambda n: (n + 3,))
    """``exp(-T / tau)`` of the lag; 0 without one."""
    mean_decay: Array = shaped(lambda n: (n + 3,))
    """``tau / T (1 - exp(-T / tau))``; 0 without a lag."""
    lagging: Array = shaped(lambda n: (n + 3,))
    """The lag's output at the current tick, N m."""
    is_exact: float = shaped(lambda n: ())
    """1 if the drive is exact, so that its kernel is skipped; see `judge`."""

    @classmethod
    def build(cls, n: int, settings: DriveSettings, period: float) -> Drive:
        """Read the settings for a robot of ``n`` joints and ticks of ``period``, s.

        Raises:
            InputError: see `per_axis`.
        """
        names = ("scale", "bias", "step", "dead_band")
        lags = per_axis(settings, "drive_lag", n)
        decays = np.array([lag_decays(lag, period) for lag in lags])
        drive = cls.allocate(n)
        assign(
            drive,
            **{name: per_axis(settings, f"drive_{name}", n) for name in names},
            decay=decays[:, 0],
            mean_decay=decays[:, 1],
        )
        judge(drive)
        return drive


def judge(drive: Drive) -> None:
    """Update ``is_exact``; to be called after any parameter has changed."""
    errors = (drive.scale - 1.0, drive.bias, drive.step, drive.dead_band, drive.mean_decay)
    assign(drive, is_exact=not np.any(errors))


def lag_decays(lag: float, period: float) -> tuple[float, float]:
    """Return ``exp(-T / tau)`` and its mean over the tick, for a lag ``tau`` and a period, s.

    They are rounded from decimal arithmetic, which is the same on every machine.
    """
    if lag == 0.0:
        return 0.0, 0.0
    ratio = Decimal(period) / Decimal(lag)
    decay = (-ratio).exp()
    return float(decay), float((1 - decay) / ratio)


@kernel
def drive_torque(drive: Drive, asked: Array, applied: Array) -> None:
    """Write into ``applied`` (n+3,) what the drives make of ``asked`` (n+3,) over a tick, N m."""
    is_exact = drive.is_exact != 0.0
    if all_lanes(is_exact):
        applied[:] = asked
        return
    for i in range(asked.size):
        mean_decay = drive.mean_decay[i]
        u = in_steps(asked[i], drive.step[i])
        u = where(abs(u) < drive.dead_band[i], 0.0, u)
        if any_lane(mean_decay > 0.0):
            behind = drive.lagging[i] - u
            drive.lagging[i] = where(mean_decay > 0.0, u + behind * drive.decay[i], 0.0)
            u = where(mean_decay > 0.0, u + behind * mean_decay, u)
        applied[i] = where(is_exact, asked[i], drive.scale[i] * u + drive.bias[i])


DRIVE_SCALE = Kind(
    "drive_scale",
    Argument("FACTOR", "1", -100.0, 100.0, about=About.AXIS),
    None,
    "the applied torque is FACTOR times the commanded torque",
)
DRIVE_BIAS = Kind(
    "drive_bias",
    Argument("TORQUE", "N m", -1e6, 1e6, about=About.AXIS),
    None,
    "the applied torque is TORQUE plus the commanded torque",
)


class WrongDrive:
    """Fault: temporary change of scale or bias of some axes."""

    KINDS: ClassVar[tuple[Kind, ...]] = (DRIVE_SCALE, DRIVE_BIAS)

    def __init__(self, schedule: Schedule) -> None:
        self._scale = TemporaryChange(schedule.of(DRIVE_SCALE))
        self._bias = TemporaryChange(schedule.of(DRIVE_BIAS))

    def apply(self, tick: int, part: Drive) -> None:
        """Apply the faults of the drives from ``tick`` to the next."""
        is_scaled = self._scale.apply(tick, part.scale, _multiply)
        if self._bias.apply(tick, part.bias, _add) or is_scaled:
            judge(part)


def _multiply(scale: Array, fault: ScheduledFault) -> None:
    scale[list(fault.axes)] *= fault.value


def _add(bias: Array, fault: ScheduledFault) -> None:
    bias[list(fault.axes)] += fault.value
