"""Power spectra by Welch's method (IEEE Trans. Audio Electroacoust. 15, 1967), as SciPy has it.

SciPy's own takes all rows at once, and costs every `simulate` more time to import than its report.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import BLOCK_TICKS

Array = NDArray[np.float64]


def segment_spectra(
    values: Callable[[int, int], Array],
    ticks: int,
    window: Array,
    step: int,
    is_detrended: bool = False,
) -> Iterator[Array]:
    """Yield the one-sided power spectrum (F, axes) of each whole segment of a signal.

    The power at a frequency is the squared size of the transform, that of the negative frequency
    added.

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
    together = max(1, (BLOCK_TICKS - length) // step + 1)
    for first in range(0, len(starts), together):
        part = starts[first : first + together]
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
