"""Spectra of a signal that comes in parts, by Welch's method.

They are those of segments under a Hann window that overlap, the last one moved back so that it is
whole (IEEE Trans. Audio Electroacoust. 15, 1967).

SciPy's Welch leaves out a segment that does not reach the end, takes all rows at once, and costs
every `simulate` more time to import than its report.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import BLOCK_TICKS

Array = NDArray[np.float64]

CHATTER_FREQUENCY = 100.0
"""Hz; power above it is chatter."""


class Segments:
    """Cuts rows (N, axes) that come in parts into segments that overlap."""

    def __init__(self, axes: int, length: int, step: int) -> None:
        """Begin without rows.

        Args:
            axes: of the signal.
            length: rows of a segment.
            step: rows from the first of a segment to the first of the next.
        """
        self._length, self._step = length, step
        self._rows: Array = np.empty((0, axes))
        """The last ones, as many as a segment has."""
        self._next = 0
        """Index in them at which the next segment begins."""

    def add(self, values: Array) -> Iterator[Array]:
        """Take further rows; yield each segment that they complete."""
        length = self._length
        rows = np.concatenate([self._rows, values])
        while len(rows) - self._next >= length:
            yield rows[self._next : self._next + length]
            self._next += self._step
        passed = max(0, len(rows) - length)
        self._rows, self._next = rows[passed:], self._next - passed

    @property
    def longest(self) -> int:
        """Rows of the longest segment so far, that of `last` included."""
        return len(self._rows)

    def last(self) -> Array | None:
        """Return the segment that ends with the last row; None: it has been yielded.

        It is shorter than others only if there are fewer rows.
        """
        is_yielded = len(self._rows) == self._length and self._next == self._step
        return None if is_yielded else self._rows


class PowerAbove:
    """Each axis' share of power above a frequency, of rows (N, axes) that come in parts.

    Segments of `BLOCK_TICKS` rows, each half over the one before; their powers are added, so that
    a segment counts as much as it has power.
    """

    def __init__(
        self,
        axes: int,
        period: float,
        frequency: float = CHATTER_FREQUENCY,
        segment: int = BLOCK_TICKS,
    ) -> None:
        """Begin without rows.

        Args:
            axes: of the signal.
            period: s, from row to row.
            frequency: Hz.
            segment: rows of a segment, an even number.
        """
        self._period, self._frequency = period, frequency
        self._segments = Segments(axes, segment, segment // 2)
        self._power: Array = np.zeros((2, axes))
        """Above the frequency, and of all frequencies, of the segments so far."""

    def add(self, values: Array) -> None:
        """Take further rows."""
        for rows in self._segments.add(values):
            self._power += self._powers(rows)

    def shares(self) -> Array:
        """Return the shares of all rows so far, (axes,); 0 without power or such a frequency."""
        power, last = self._power, self._segments.last()
        if last is not None:
            power = power + self._powers(last)
        high, total = power
        shares: Array = np.divide(high, total, out=np.zeros_like(high), where=total > 0.0)
        return shares

    def _powers(self, rows: Array) -> Array:
        """(2, axes) as in `_power`, of one segment."""
        if len(rows) < 2 or 0.5 / self._period <= self._frequency:
            return np.zeros_like(self._power)
        window = hann(len(rows), len(rows) - 1)  # keeps slow motion from leaking upwards
        f, power = one_sided_power(window[:, np.newaxis] * rows, self._period)
        return np.stack([np.sum(power[f > self._frequency], axis=0), np.sum(power, axis=0)])


class PowerSpectrum:
    """The mean square of each axis by frequency, of rows (N, axes) that come in parts.

    Each segment's trend goes first. Segments begin a quarter of their length apart, for then the
    squares of Hann's windows add up to a constant: but for both ends of the signal every moment
    counts alike, whatever happens in it.
    """

    def __init__(self, axes: int, period: float, segment: int, above: float = 0.0) -> None:
        """Begin without rows.

        Args:
            axes: of the signal.
            period: s, from row to row.
            segment: rows of a segment, at least 4.
            above: Hz, from where on `of_segments` counts.
        """
        self._period = period
        self._segments = Segments(axes, segment, segment // 4)
        self._first = math.ceil(above * segment * period * (1.0 - 1e-9))
        self._power: Array | float = 0.0
        """The sum over the segments so far."""
        self._each: list[Array] = []
        """(axes,) mean square of each of them above a frequency."""

    def add(self, values: Array) -> None:
        """Take further rows."""
        for rows in self._segments.add(values):
            power = self._mean_squares(rows)
            self._power = self._power + power
            self._each.append(np.sum(power[self._first :], axis=0))

    def of_segments(self) -> Array:
        """Return the mean square above the frequency in each whole segment so far, (S, axes)."""
        return np.array(self._each)

    def value(self) -> tuple[Array, Array]:
        """Return the frequencies, (F,) Hz, and the mean square of each axis at each, (F, axes).

        There must be two rows. The signal's mean square is the sum over all frequencies, and the
        power spectral density the mean square over the distance of two frequencies.
        """
        power, count, last = self._power, len(self._each), self._segments.last()
        if last is not None:
            power, count = power + self._mean_squares(last), count + 1
        mean: Array = np.asarray(power) / count
        frequency = np.asarray(np.fft.rfftfreq(self._segments.longest, self._period), np.float64)
        return frequency, mean

    def _mean_squares(self, rows: Array) -> Array:
        """(F, axes) of one segment."""
        size = len(rows)
        window, time = hann(size, size), np.arange(size) - 0.5 * (size - 1)
        slope = time @ rows / np.sum(time * time)
        steady = rows - np.mean(rows, axis=0) - time[:, np.newaxis] * slope
        _, power = one_sided_power(window[:, np.newaxis] * steady, self._period)
        return power / (size * np.sum(window**2))


def hann(rows: int, period: int) -> Array:
    """Return ``rows`` numbers of Hann's window of a ``period`` in rows."""
    window: Array = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(rows) / period)
    return window


def one_sided_power(rows: Array, period: float) -> tuple[Array, Array]:
    """Return the frequencies, (F,) Hz, and the squared size of rows' spectrum, (F, axes).

    That of the negative frequencies is added to that of the positive ones.
    """
    power: Array = np.abs(np.fft.rfft(rows, axis=0)) ** 2
    f = np.asarray(np.fft.rfftfreq(len(rows), period), np.float64)
    inside = (f > 0.0) & (f < 0.5 / period * (1.0 - 1e-12))
    power[inside] *= 2.0
    return f, power
