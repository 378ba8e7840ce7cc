"""A flight over time in about a hundred numbers: the maximum of each column in each time bin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BINS = 100
"""Bins of a flight; a flight with fewer ticks has one bin per tick."""


class Bands:
    """Accumulates the bins of a flight's columns."""

    def __init__(self, ticks: int) -> None:
        """Start empty; bin k of K begins at tick ``k ticks // K``.

        Args:
            ticks: of the whole flight.
        """
        count = min(BINS, ticks)
        self._starts = np.arange(count, dtype=np.int64) * ticks // count
        self._ticks = ticks
        self._largest: dict[str, Array] = {}

    def add(self, first_tick: int, sizes: dict[str, Array]) -> None:
        """Add the magnitudes (N,) of the ticks from ``first_tick`` on, by column."""
        for name, size in sizes.items():
            if not len(size):
                continue
            largest = self._largest.setdefault(name, np.zeros(len(self._starts)))
            stop = first_tick + len(size)
            low = int(np.searchsorted(self._starts, first_tick, side="right")) - 1
            high = int(np.searchsorted(self._starts, stop, side="left"))
            cuts = np.maximum(self._starts[low:high] - first_tick, 0)
            part = largest[low:high]
            np.maximum(part, np.maximum.reduceat(size, cuts), out=part)

    def result(self) -> dict[str, NDArray[np.float32]]:
        """Return the bins of each column, for a flight that was flown to its end."""
        with np.errstate(over="ignore"):
            return {name: values.astype(np.float32) for name, values in self._largest.items()}
