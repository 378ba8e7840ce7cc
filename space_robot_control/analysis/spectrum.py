"""The share of power above a frequency, of a signal that comes in parts.

Up to `BLOCK_TICKS` rows it is taken from one spectrum under a Hann window. Of more it is Welch's
(IEEE Trans. Audio Electroacoust. 15, 1967): segments of that length, each half over the one before,
the last one moved back so that it is whole; their powers are added, so that a segment counts as
much as it has power. SciPy's Welch takes the mean of segments that do not reach the end, of all
rows at once, and importing it costs every `simulate` more time than its report.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.blocks import BLOCK_TICKS

Array = NDArray[np.float64]

CHATTER_FREQUENCY = 100.0
"""Hz; power above it is chatter."""


class PowerAbove:
    """Each axis' share of power above a frequency, of rows (N, axes) that come in parts."""

    def __init__(
        self, axes: int, period: float, frequency: float = CHATTER_FREQUENCY,
        segment: int = BLOCK_TICKS,
    ) -> None:  # fmt: skip
        """Begin without rows.

        Args:
            axes: of the signal.
            period: s, from row to row.
            frequency: Hz.
            segment: rows of a segment, an even number.
        """
        self._period, self._frequency, self._segment = period, frequency, segment
        self._power = np.zeros((2, axes))
        """Above the frequency, and of all frequencies, of the segments so far."""
        self._rows = np.empty((0, axes))
        """The last ones, as many as a segment has."""
        self._next = 0
        """Index in them at which the next segment begins."""

    def add(self, values: Array) -> None:
        """Take further rows."""
        segment = self._segment
        rows = np.concatenate([self._rows, values])
        while len(rows) - self._next >= segment:
            self._power += self._powers(rows[self._next : self._next + segment])
            self._next += segment // 2
        passed = max(0, len(rows) - segment)
        self._rows, self._next = rows[passed:], self._next - passed

    def shares(self) -> Array:
        """Return the shares of all rows so far, (axes,); 0 without power or such a frequency."""
        power = self._power
        taken = (
            len(self._rows) == self._segment
            and len(self._rows) - self._next == len(self._rows) // 2
        )
        if not taken:  # no segment ends with the last row
            power = power + self._powers(self._rows)
        high, total = power
        shares: Array = np.divide(high, total, out=np.zeros_like(high), where=total > 0.0)
        return shares

    def _powers(self, rows: Array) -> Array:
        """(2, axes) as in `_power`, of one segment."""
        if len(rows) < 2 or 0.5 / self._period <= self._frequency:
            return np.zeros_like(self._power)
        window = np.hanning(len(rows))[:, np.newaxis]  # keeps slow motion from leaking upwards
        power = np.abs(np.fft.rfft(window * rows, axis=0)) ** 2
        f = np.fft.rfftfreq(len(rows), self._period)
        inside = (f > 0.0) & (f < 0.5 / self._period * (1.0 - 1e-12))
        power[inside] *= 2.0  # the negative frequencies' half
        return np.stack([np.sum(power[f > self._frequency], axis=0), np.sum(power, axis=0)])
