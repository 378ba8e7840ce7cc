"""Ripple: the part of the torque that neither motion, nor friction, nor disturbances ask for.

From the torque applied is taken away what inverse dynamics of the nominal robot asks along the
*reference*, its base free to drift (`space_robot_model.robot.dynamics.inverse_dynamics`). What is
left has a slow part that every law must give: friction, disturbances (0.25 to 0.75 Hz in the
paper), an unknown payload's share of the motion. Ripple is what is left above `SLOWEST`. It is
summed up in the spectrum (`spectrum.PowerSpectrum`), so that limit cycle, noise and switching are
distinguished by their frequency.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import free_inverse_dynamics, inverse_dynamics
from space_robot_msgs_py.bag.flight_log import FlightLog, Metric, blocks_of
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from .attitude_drift import controls_base
from .metrics import AxisIndex, torque_columns
from .spectrum import PowerSpectrum

Array = NDArray[np.float64]

SLOWEST = 2.0
"""Hz; slower is what the task asks for, faster is ripple."""
FAST = 25.0
"""Hz; above the laws' limit cycles, where noise and switching are left."""
SEGMENT_S = 4.0
"""s of a segment of the spectrum: lines 0.25 Hz apart. Under Hann's window a disturbance of
0.75 Hz has sunk to 1e-4 of its power at `SLOWEST`."""
SHORTEST_S = 1.0
"""s of flight without which nothing can be said."""
LASTING = 0.1
"""Share of the mean power from which on a segment has ripple."""
LINE = 2
"""Frequencies on either side that a sine fills under Hann's window."""


class Peak(NamedTuple):
    """The highest place of a spectrum that is higher than its surroundings."""

    frequency: float
    """Hz."""
    rms: float
    """Of what is within `LINE` frequencies of it, mean over the axes; of a sine its whole RMS."""


class RippleSpectrum(NamedTuple):
    """The mean square of a flight's ripple by frequency."""

    frequency: Array
    """(F,) Hz, above `SLOWEST`."""
    mean_square: Array
    """(F, n+3) N2 m2 of each axis, N2 of prismatic joints."""

    def group(self, axes: AxisIndex) -> Array:
        """(F,) N2 m2 or N2, mean over some axes."""
        mean: Array = np.mean(self.mean_square[:, axes], axis=1)
        return mean

    def rms(self, above: float = SLOWEST) -> Array:
        """(n+3,) N m or N, of each axis' ripple ``above`` a frequency, Hz."""
        first = int(np.searchsorted(self.frequency, above * (1.0 - 1e-9)))
        rms: Array = np.sqrt(np.sum(self.mean_square[first:], axis=0))
        return rms

    def peak(self, axes: AxisIndex) -> Peak | None:
        """Find the peak of the mean over some axes; None: it falls or rises all the way."""
        power = self.group(axes)
        inner = power[1:-1]
        tops = 1 + np.flatnonzero((inner > power[:-2]) & (inner > power[2:]))
        if not len(tops):
            return None
        top = int(tops[np.argmax(power[tops])])
        near = slice(max(0, top - LINE), top + LINE + 1)
        rms = np.sqrt(np.sum(self.mean_square[near, axes], axis=0))
        frequency = float(np.sum(self.frequency[near] * power[near]) / np.sum(power[near]))
        return Peak(frequency, float(np.mean(rms)))


class Ripple(Metric):
    """Sums up the spectrum of the ripple of a flight of ``robot``."""

    def __init__(self, log: FlightLog, robot: Robot) -> None:
        """``log``: the first rows.

        Raises:
            InputError: the ticks are too far apart.
        """
        self._robot, self._period = robot, log.timebase.period
        if 0.5 / self._period <= SLOWEST:
            raise InputError(f"ticks less than {0.5 / SLOWEST:g} s apart are needed")
        self._names = (*BASE_AXES, *log.joint_names)
        self._columns = torque_columns(log.axes, controls_base(log), log.prismatic, log.branches)
        segment = round(SEGMENT_S / self._period)
        self._spectrum = PowerSpectrum(log.axes, self._period, segment, SLOWEST)
        self._rows = 0

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        self._spectrum.add(log.applied_torque - desired_torque(log, self._robot))
        self._rows += log.ticks

    def spectrum(self) -> RippleSpectrum:
        """Return the spectrum of all rows so far.

        Raises:
            InputError: there are too few.
        """
        if self._rows * self._period < SHORTEST_S * (1.0 - 1e-9):
            raise InputError(f"{SHORTEST_S:g} s of flight are needed")
        frequency, mean_square = self._spectrum.value()
        first = int(np.searchsorted(frequency, SLOWEST * (1.0 - 1e-9)))
        return RippleSpectrum(frequency[first:], mean_square[first:])

    def result(self) -> dict[str, Any]:
        """Return the RMS by torque column and by axis, N m or N, and the peak of each column.

        ``fast`` is the RMS of what is above `FAST`. ``lasting`` is the share of the segments in
        which a column has at least `LASTING` of its mean power: of a burst a small one.
        """
        spectrum = self.spectrum()
        columns, rms, fast = self._columns, spectrum.rms(), spectrum.rms(FAST)
        peaks = {name: spectrum.peak(axes) for name, axes in columns.items()}
        return {
            "above_hz": SLOWEST,
            "rms": {name: float(np.mean(rms[axes])) for name, axes in columns.items()},
            "fast": {
                "above_hz": FAST,
                "rms": {name: float(np.mean(fast[axes])) for name, axes in columns.items()},
            },
            "axes": {name: float(value) for name, value in zip(self._names, rms, strict=True)},
            "peak": {
                name: peak and {"frequency_hz": peak.frequency, "rms": peak.rms}
                for name, peak in peaks.items()
            },
            "lasting": {name: self._lasting(axes) for name, axes in columns.items()},
        }

    def _lasting(self, axes: AxisIndex) -> float | None:
        """Return the share of segments with ripple on some axes; None: there are no two."""
        each = self._spectrum.of_segments()
        if len(each) < 2:
            return None
        power = np.mean(each[:, axes], axis=1)
        return float(np.mean(power >= LASTING * np.mean(power)))


def desired_torque(log: FlightLog, robot: Robot) -> Array:
    """(N, n+3) N m, what inverse dynamics asks of ``robot`` along the reference of each tick.

    Prismatic joints have N; joints without motors are locked.
    """
    references = log.references(log.first_tick, log.first_tick + log.ticks)
    references["quaternion"] = unit_rows(references["quaternion"])
    return (inverse_dynamics if controls_base(log) else free_inverse_dynamics)(
        robot.nominal, references
    )


def ripple_spectrum(log: FlightLog, robot: Robot) -> RippleSpectrum:
    """Return the spectrum of the ripple of a whole log.

    Raises:
        InputError: it is too short, or its ticks too far apart.
    """
    ripple = Ripple(log, robot)
    for block in blocks_of(log):
        ripple.add(block, np.empty(0))
    return ripple.spectrum()
