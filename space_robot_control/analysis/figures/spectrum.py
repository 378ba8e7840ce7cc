"""Welch's estimate of a signal's power by frequency."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.signal
from numpy.typing import NDArray

Array = NDArray[np.float64]

_welch: Any = scipy.signal.welch  # some of its published types know no linear trend

SEGMENT = 2048
"""Samples of a segment: about 1 Hz of resolution at 2 kHz."""
SHORTEST = 64
"""Samples below which a spectrum says nothing."""


def power_spectral_density(values: Array, period: float) -> tuple[Array, Array]:
    """Frequencies above 0, Hz, and the density of the power of all columns together.

    Args:
        values: (N, axes) samples; the rows from the first that is not finite on are left out.
        period: s, between two samples.

    Returns:
        Both empty if there are too few samples; the density in the square of the values' unit
        per Hz, NaN where there is no power.
    """
    known = np.all(np.isfinite(values), axis=1)
    samples = values[: len(values) if known.all() else int(np.argmin(known))]
    if len(samples) < SHORTEST:
        return np.empty(0), np.empty(0)
    # Each segment's trend goes, else the slow motion leaks into the high frequencies.
    frequency, density = _welch(
        samples, 1.0 / period, nperseg=min(SEGMENT, len(samples)), detrend="linear", axis=0
    )
    total = np.sum(density[1:], axis=1)
    return frequency[1:], np.where(total > 0.0, total, np.nan)
