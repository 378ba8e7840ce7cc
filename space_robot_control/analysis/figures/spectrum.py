"""Welch's estimate of a signal's power by frequency."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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
    length = min(SEGMENT, len(samples))
    total = np.sum(welch(samples, period, length)[1:], axis=1)
    frequency = np.arange(1, length // 2 + 1) / (length * period)
    return frequency, np.where(total > 0.0, total, np.nan)


def welch(values: Array, period: float, length: int) -> Array:
    """One-sided density of each column's power, the mean over segments that overlap by half.

    SciPy has it too, as ``welch(..., detrend="linear")``, and takes a second to import. Each
    segment's trend goes, else the slow motion leaks into the high frequencies.

    Args:
        values: (N, axes) samples.
        period: s, between two samples.
        length: samples of a segment, at most N.

    Returns:
        (length // 2 + 1, axes), the square of the values' unit per Hz.
    """
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)
    time = np.arange(length) - 0.5 * (length - 1)
    every = np.lib.stride_tricks.sliding_window_view(values, length, axis=0)
    segments = every[:: length - length // 2]
    level = np.mean(segments, axis=-1, keepdims=True)
    slope = np.sum(segments * time, axis=-1, keepdims=True) / np.sum(time**2)
    spectra = np.fft.rfft(window * (segments - level - slope * time), axis=-1)
    density: Array = np.mean(np.abs(spectra) ** 2, axis=0).T * (period / np.sum(window**2))
    density[1 : (length + 1) // 2] *= 2.0  # the negative frequencies' half
    return density
