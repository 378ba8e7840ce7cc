"""A flight over time in about a hundred numbers: the maximum of each column in each time bin."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BINS = 100
"""Bins of a flight; a flight with fewer ticks has one bin per tick."""


def largest_in_bins(
    blocks: Iterable[tuple[int, Mapping[str, Array]]], ticks: int
) -> dict[str, NDArray[np.float32]]:
    """Return the largest size of each column in each bin; bin k of K begins at ``k ticks // K``.

    Args:
        blocks: first tick, and the sizes (N,) by column, of each block of a flight.
        ticks: of the whole flight, which was flown to its end.
    """
    count = min(BINS, ticks)
    starts = np.arange(count, dtype=np.int64) * ticks // count
    largest: dict[str, Array] = {}
    for first, sizes in blocks:
        for name, size in sizes.items():
            own = largest.setdefault(name, np.zeros(count))
            low = int(np.searchsorted(starts, first, side="right")) - 1
            high = int(np.searchsorted(starts, first + len(size), side="left"))
            cuts = np.maximum(starts[low:high] - first, 0)
            np.maximum(own[low:high], np.maximum.reduceat(size, cuts), out=own[low:high])
    with np.errstate(over="ignore"):
        return {name: values.astype(np.float32) for name, values in largest.items()}
