"""Thinning a signal to what a printed line can show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

COLUMNS = 250
"""Pixel columns of a panel of 70 mm: narrower than the line is thick, so that bands look filled."""


def envelope(signal: Array, columns: int = COLUMNS) -> Indices:
    """Samples of a long signal that draw the same line as all of them.

    The signal is cut into ``columns`` equal stretches; of each the lowest and the highest sample
    are kept, so no peak is lost and chatter stays a band of its full width.

    Args:
        signal: (N,) evenly spaced samples; one that is not finite is kept only where a stretch
            has no other.
        columns: pixel columns of the drawn line.

    Returns:
        Rising indices, among them the first and the last; all N if that is no more than two a
        column.
    """
    count = len(signal)
    if count <= 2 * columns:
        return np.arange(count)
    length = -(-count // columns)
    starts = np.arange(0, count, length)
    padded = np.pad(signal, (0, len(starts) * length - count), mode="edge")
    stretches = padded.reshape(len(starts), length)
    known = np.isfinite(stretches)
    if known.all():
        lowest, highest = np.argmin(stretches, axis=1), np.argmax(stretches, axis=1)
    else:
        lowest = np.argmin(np.where(known, stretches, np.inf), axis=1)
        highest = np.argmax(np.where(known, stretches, -np.inf), axis=1)
    kept = np.concatenate([[0], starts + lowest, starts + highest, [count - 1]])
    return np.unique(np.minimum(kept, count - 1))
