"""Sine and cosine."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine

Array = NDArray[np.float64]

TURNS = 2.0 / math.pi
"""Quarter turns a radian."""
QUARTER = (
    1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32,
)  # fmt: skip
"""Parts of a quarter turn, rad: three of 33 bits, so that a multiple by 20 bits is exact."""
EXACT_LIMIT = 1.6e6
"""Up to this angle, rad, a multiple of a quarter turn has no more than 20 bits."""
(S3, S5, S7, S9, S11, S13, S15, S17) = (
    (-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 9)
)
(C4, C6, C8, C10, C12, C14, C16) = ((-1.0) ** k / math.factorial(2 * k) for k in range(2, 9))


@kernel
def sin_cos(angle: float) -> tuple[float, float]:
    """Return sine and cosine of ``angle``, rad; NaN of an angle that is not finite.

    Their error is below 0.8 units in the last place up to 1.6 million radians. Beyond, they are
    those of an angle that is nearer to ``angle`` than its neighbours among the floats.
    """
    if abs(angle) > EXACT_LIMIT:
        if not math.isfinite(angle):
            return math.nan, math.nan
        angle = np.fmod(angle, 2.0 * math.pi)  # exact, by IEEE 754
    if abs(angle) <= 0.25 * math.pi:
        return _sine(angle, 0.0), _cosine(angle, 0.0)
    turns = np.floor(angle * TURNS + 0.5)
    x, rest = _difference(angle - turns * QUARTER[0], turns * QUARTER[1])
    x, more = _difference(x, turns * QUARTER[2])
    rest = rest + more - turns * QUARTER[3]
    angle, rest = x + rest, (x - (x + rest)) + rest
    sine, cosine = _sine(angle, rest), _cosine(angle, rest)
    quarter = turns - 4.0 * np.floor(0.25 * turns)
    if quarter == 0.0:
        return sine, cosine
    if quarter == 1.0:
        return cosine, -sine
    if quarter == 2.0:
        return -sine, -cosine
    return -cosine, sine


def sines_cosines(angles: Array) -> tuple[Array, Array]:
    """Return sines and cosines of ``angles``, rad, in their shape."""
    found = np.array([sin_cos(float(angle)) for angle in np.ravel(angles)]).reshape(-1, 2)
    return found[:, 0].reshape(np.shape(angles)), found[:, 1].reshape(np.shape(angles))


@subroutine
def _difference(a: float, b: float) -> tuple[float, float]:
    """Return ``a - b`` rounded, and what rounding took from it (Knuth)."""
    found = a - b
    other = found - a
    return found, (a - (found - other)) - (b + other)


@subroutine
def _sine(x: float, rest: float) -> float:
    """Return the sine of ``x + rest``, up to an eighth of a turn: its Taylor series."""
    z = x * x
    series = S5 + z * (S7 + z * (S9 + z * (S11 + z * (S13 + z * (S15 + z * S17)))))
    return x + (z * x * (S3 + z * series) + rest * (1.0 - 0.5 * z))


@subroutine
def _cosine(x: float, rest: float) -> float:
    """Return the cosine of ``x + rest``, up to an eighth of a turn: its Taylor series."""
    z = x * x
    half = 0.5 * z
    large = 1.0 - half
    series = z * z * (C4 + z * (C6 + z * (C8 + z * (C10 + z * (C12 + z * (C14 + z * C16))))))
    return large + (((1.0 - large) - half) + (series - x * rest))
