"""Torques of a flight: size, chatter, and ripple.

Ripple is the part of the torque that neither motion, nor friction, nor disturbances ask for. From
the torque applied is taken away what inverse dynamics of the nominal robot asks along the
*reference*, its base free to drift (`space_robot_model.robot.dynamics.inverse_dynamics`). What is
left has a slow part that every law must give: friction, disturbances (0.25 to 0.75 Hz in the
paper), an unknown payload's share of the motion. Ripple is what is left above `SLOWEST`, summed up
in the spectrum, so that limit cycle, noise and switching are distinguished by their frequency.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array, unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import free_inverse_dynamics, inverse_dynamics
from space_robot_msgs_py.bag.flight_log import BLOCK_TICKS, FlightLog
from space_robot_msgs_py.errors import InputError

from .analysed_log import AnalysedLog
from .errors import AxisIndex, controls_base
from .pointing import TABLE_V
from .series import Definition, TimeSeries, metrics, series

CHATTER_FREQUENCY = 100.0
"""Hz; power above it is chatter."""
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


@series(
    "torques",
    {
        "base_torque": Definition("N m", "torque applied to the base", TABLE_V, True),
        "force_prismatic": Definition("N", "forces applied to the prismatic joints", TABLE_V),
        "torque_*": Definition("N m", "torques applied to these joints", TABLE_V),
    },
)
def torques(flight: AnalysedLog) -> TimeSeries:
    """Return the torques that were applied."""
    log = flight.log
    return TimeSeries(flight.torque_columns, lambda start, stop: log.applied_torque[start:stop])


@metrics(
    "torques",
    {
        "{torque}.variation": Definition(
            "{unit}/s", "how far the torque moves up and down in a second, mean over the axes"
        ),
        "{torque}.chatter": Definition(
            "share", "share of the torque's power above 100 Hz, mean over the axes"
        ),
    },
)
def roughness(flight: AnalysedLog) -> dict[str, float]:
    """Compute total variation, and the share of power above `CHATTER_FREQUENCY`."""
    torque, period = flight.log.applied_torque, flight.log.timebase.period
    ticks, axes = torque.shape

    def vary(start: int, stop: int) -> Array:
        steps = np.abs(np.diff(torque[max(start - 1, 0) : stop], axis=0))
        return np.asarray(np.sum(steps, axis=0))

    variation, power = flight.sum_up(vary), np.zeros((2, axes))
    # segments half over one another, as many as leave no part of the flight out
    step = ticks // max(2, math.ceil(2 * ticks / BLOCK_TICKS))
    length = 2 * step if ticks > BLOCK_TICKS else ticks
    high = np.fft.rfftfreq(length, period) > CHATTER_FREQUENCY
    if length > 1 and high.any():
        window = hann(length, length - 1)  # keeps slow motion from leaking upwards
        for spectrum in segment_spectra(
            lambda start, stop: torque[start:stop], ticks, window, step
        ):
            power += [spectrum[high].sum(axis=0), spectrum.sum(axis=0)]
    share = np.divide(power[0], power[1], out=np.zeros(axes), where=power[1] > 0.0)
    seconds = max(ticks - 1, 1) * period
    numbers = {}
    for name, index in flight.torque_columns.items():
        numbers[f"{name}.variation"] = float(np.mean(variation[index])) / seconds
        numbers[f"{name}.chatter"] = float(np.mean(share[index]))
    return numbers


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
    segments: Array
    """(S, n+3) the sum of the mean squares in each whole segment; a short flight has one."""

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

    def lasting(self, axes: AxisIndex) -> float | None:
        """Return the share of segments with ripple on some axes; None: there are no two."""
        if len(self.segments) < 2:
            return None
        power = np.mean(self.segments[:, axes], axis=1)
        return float(np.mean(power >= LASTING * np.mean(power)))


@metrics(
    "torques",
    {
        "{torque}.ripple": Definition(
            "{unit}",
            "RMS above 2 Hz of the torque beside the one that inverse dynamics asks for along "
            "the reference, mean over the axes: limit cycles, noise and switching",
        ),
        "{torque}.ripple_fast": Definition("{unit}", "the same above 25 Hz: noise and switching"),
        "{torque}.ripple_peak_hz": Definition("Hz", "frequency at which the ripple is largest"),
        "{torque}.ripple_peak": Definition(
            "{unit}", "RMS of the ripple within 0.5 Hz of that frequency"
        ),
        "{torque}.ripple_lasting": Definition(
            "share", "share of the segments of 4 s with a tenth of the mean ripple power or more"
        ),
        "{axis}.ripple_axis": Definition(
            "N m or N", "RMS of the ripple of one axis", is_shown=False
        ),
    },
)
def ripple(flight: AnalysedLog) -> dict[str, float]:
    """Compute RMS and peak of the ripple, by torque column and by axis."""
    spectrum = ripple_spectrum(flight)
    rms, numbers = spectrum.rms(), {}
    has_fast = 0.5 / flight.log.timebase.period > FAST
    for name, axes in flight.torque_columns.items():
        numbers[f"{name}.ripple"] = float(np.mean(rms[axes]))
        if has_fast:
            numbers[f"{name}.ripple_fast"] = float(np.mean(spectrum.rms(FAST)[axes]))
        if peak := spectrum.peak(axes):
            numbers[f"{name}.ripple_peak_hz"] = peak.frequency
            numbers[f"{name}.ripple_peak"] = peak.rms
        if (lasting := spectrum.lasting(axes)) is not None:
            numbers[f"{name}.ripple_lasting"] = lasting
    each = zip(flight.axis_names, rms, strict=True)
    return numbers | {f"{name}.ripple_axis": float(value) for name, value in each}


def lacking_for_ripple(name: str, seconds: float, period: float) -> str:
    """Return why a metric is not a ripple of some seconds of a flight; empty: there may be one.

    ``period``: of the ticks, s.
    """
    if ".ripple" not in name:
        return ""
    above = FAST if name.endswith(".ripple_fast") else SLOWEST
    if 0.5 / period <= above:
        return f"needs a period below {0.5 / above:g} s, got {period:g} s"
    if seconds < SHORTEST_S * (1.0 - 1e-9):
        return f"needs {SHORTEST_S:g} s of flight, got {seconds:g} s"
    return ""


def ripple_spectrum(flight: AnalysedLog) -> RippleSpectrum:
    """Return the spectrum of the ripple.

    Segments begin a quarter of their length apart, for then the squares of Hann's windows add up to
    a constant: but for both ends of the flight every moment counts alike.
    """
    log, period, robot = flight.log, flight.log.timebase.period, flight.robot
    if 0.5 / period <= SLOWEST:
        raise InputError(f"ticks less than {0.5 / SLOWEST:g} s apart are needed")
    if log.ticks * period < SHORTEST_S * (1.0 - 1e-9):
        raise InputError(f"{SHORTEST_S:g} s of flight are needed")
    segment = round(SEGMENT_S / period)
    length = min(segment, log.ticks)
    frequency = np.asarray(np.fft.rfftfreq(length, period), np.float64)
    first = int(np.searchsorted(frequency, SLOWEST * (1.0 - 1e-9)))
    window = hann(length, length)

    def values(start: int, stop: int) -> Array:
        rows = log.rows(start, stop)
        return rows.applied_torque - desired_torque(rows, robot)

    total, each = np.zeros((len(frequency) - first, log.axes)), []
    for power in segment_spectra(values, log.ticks, window, segment // 4, is_detrended=True):
        mean_square = power[first:] / (length * np.sum(window**2))
        total += mean_square
        each.append(mean_square.sum(axis=0))
    return RippleSpectrum(frequency[first:], total / len(each), np.array(each))


def desired_torque(log: FlightLog, robot: Robot) -> Array:
    """(N, n+3) N m, what inverse dynamics asks of ``robot`` along the reference of each tick.

    Prismatic joints have N; joints without motors are locked.
    """
    references = log.references(log.first_tick, log.first_tick + log.ticks)
    references["quaternion"] = unit_rows(references["quaternion"])
    return (inverse_dynamics if controls_base(log) else free_inverse_dynamics)(
        robot.nominal, references
    )


def segment_spectra(
    values: Callable[[int, int], Array],
    ticks: int,
    window: Array,
    step: int,
    is_detrended: bool = False,
) -> Iterator[Array]:
    """Yield the one-sided power spectrum (F, axes) of each whole segment of a signal.

    The power is the squared size of the transform, that of the negative frequency added.

    Args:
        values: returns the rows (stop - start, axes) from ``start`` to before ``stop``.
        ticks: rows of the signal.
        window: (L,) weights of a segment's rows.
        step: rows from the first of a segment to the first of the next.
        is_detrended: whether each segment's linear trend goes first.
    """
    length = len(window)
    time = np.arange(length) - 0.5 * (length - 1)
    starts = range(0, ticks - length + 1, step)
    group = max(1, (BLOCK_TICKS - length) // step + 1)
    for first in range(0, len(starts), group):
        part = starts[first : first + group]
        rows = values(part[0], part[-1] + length)
        for start in part:
            segment = rows[start - part[0] : start - part[0] + length]
            if is_detrended:
                slope = time @ segment / np.sum(time * time)
                segment = segment - np.mean(segment, axis=0) - time[:, np.newaxis] * slope
            power: Array = np.abs(np.fft.rfft(window[:, np.newaxis] * segment, axis=0)) ** 2
            power[1 : (length + 1) // 2] *= 2.0  # but not at zero and at Nyquist's frequency
            yield power


def hann(rows: int, period: int) -> Array:
    """Return ``rows`` numbers of Hann's window of a ``period`` in rows."""
    window: Array = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(rows) / period)
    return window
