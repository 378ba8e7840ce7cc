"""What noise allows: weights of low-passes and bandwidths with a ripple up to an allowed one."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError

from .noise import Noise

Array = NDArray[np.float64]

LEAST_WEIGHT = 1e-4
"""Smallest weight of a low-pass: a corner of 0.03 Hz at 2 kHz."""
BISECTIONS = 12
"""Bisections: the weight is then more precise than the written digits."""


def quiet_weight(largest: float, noise_of: Callable[[float], Array], allowed: Array) -> float:
    """Return the largest weight, at most ``largest``, with noise up to ``allowed`` (m,).

    Args:
        largest: weight of a low-pass.
        noise_of: returns the noise (m,) with a weight.
        allowed: in the unit of the noise.

    Raises:
        InputError: there is no such weight.
    """
    if np.all(noise_of(largest) <= allowed):
        return largest
    if np.any(noise_of(LEAST_WEIGHT) > allowed):
        raise InputError("no low-pass reduces the noise of these sensors enough: allow more ripple")
    return largest_quiet(LEAST_WEIGHT, largest, lambda weight: noise_of(weight) / allowed)


def largest_quiet(low: float, high: float, share_of: Callable[[float], Array]) -> float:
    """Return the largest parameter in a range with all shares up to 1, by bisection.

    Args:
        low: with shares up to 1, or the result.
        high: with a share above 1.
        share_of: returns shares (m,) of the allowed noise, which grow with the parameter.
    """
    low, high = math.log(low), math.log(high)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        is_quiet = np.all(share_of(math.exp(middle)) <= 1.0)
        low, high = (middle, high) if is_quiet else (low, middle)
    return math.exp(low)


def quiet_bandwidth(own: Array, noise: Noise | None, allowed: Array) -> float:
    """Return the largest W, rad/s, with noise up to ``allowed`` (m,), N m, of a law without lag.

    ``own^2 (4 W^2 sigma_rate^2 + W^4 sigma_e^2) = allowed^2`` on the limiting axis; ``own`` (m,) is
    the inertia by which the law multiplies K_P and K_D, kg m2.
    """
    if noise is None or not noise.rates.any():
        return math.inf
    rate, angle = 2.0 * own * noise.rates.std(axis=0), own * noise.errors.std(axis=0)
    root = np.sqrt(rate**4 + 4.0 * (angle * allowed) ** 2)
    with np.errstate(divide="ignore"):
        squares = 2.0 * allowed**2 / (rate**2 + root)
    return float(np.sqrt(squares.min()))


def low_pass_corner(weight: float, period: float) -> float:
    """Return the corner, Hz, of a low-pass with a ``weight``; 0 (no low-pass) for 1."""
    return 0.0 if weight >= 1.0 else -math.log(1.0 - weight) / (2.0 * math.pi * period)
