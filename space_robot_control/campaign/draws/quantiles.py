"""The functions that turn uniform numbers into others."""

from __future__ import annotations

import math

from scipy.special import ndtri


def exp(x: float) -> float:
    """Return e to the power of ``x``."""
    return math.exp(x)


def log(x: float) -> float:
    """Return the natural logarithm."""
    return math.log(x)


def normal_quantile(p: float) -> float:
    """Return the standard normal number that a share ``p`` of all is below."""
    return float(ndtri(p))


def normal_probability(x: float) -> float:
    """Return the share of all standard normal numbers below ``x``, by bisection.

    So it goes with `normal_quantile`; it is 0 below the least number that a quantile is asked of.
    """
    low, high = 0.0, 1.0
    for _ in range(64):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if normal_quantile(middle) < x:
            low = middle
        else:
            high = middle
    return low if x > 0.0 else high if high > 2.0**-60 else 0.0
