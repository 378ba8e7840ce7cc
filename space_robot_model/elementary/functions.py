"""Elementary functions for kernels and, where they are needed, for arrays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import any_lane, where

from .matrices import Array
from .rotations import plain_angle_of, plain_sin_cos

LN2 = (0.6931471803691238, 1.9082149292705877e-10)
"""log 2 in two parts, the first with 32 bits, so that its product with an exponent is exact."""
LARGEST, SMALLEST = 709.782712893384, -745.1332191019412
"""Range of arguments with a finite exponential above 0."""
ROOT_HALF = math.sqrt(0.5)
(E2, E3, E4, E5, E6, E7, E8, E9, E10, E11, E12, E13, E14) = (
    1.0 / math.factorial(k) for k in range(2, 15)
)
(L1, L2, L3, L4, L5, L6, L7, L8, L9, L10, L11) = (2.0 / (2 * k + 1) for k in range(1, 12))
sin_cos = kernel(plain_sin_cos)
"""`plain_sin_cos`, compiled."""
angle_of = kernel(plain_angle_of)
"""`plain_angle_of`, compiled."""


def sines_cosines(angles: ArrayLike) -> tuple[Array, Array]:
    """Return sines and cosines of ``angles``, rad, in the same shape."""
    values = np.asarray(angles, dtype=np.float64, order="C")
    sines, cosines = np.empty(values.shape), np.empty(values.shape)
    _fill_sines_cosines(values.reshape(-1), sines.reshape(-1), cosines.reshape(-1))
    return sines, cosines


@kernel
def _fill_sines_cosines(angles: Array, sines: Array, cosines: Array) -> None:
    for i in range(angles.size):
        sines[i], cosines[i] = sin_cos(angles[i])


def arctan2(y: ArrayLike, x: ArrayLike) -> Array:
    """Return the angles of points (x, y), rad, from -pi to pi, in the shape of ``y`` and ``x``."""
    sines, cosines = np.broadcast_arrays(y, x)
    angles = np.empty(sines.shape)
    _fill_angles(
        np.ascontiguousarray(sines, dtype=np.float64).reshape(-1),
        np.ascontiguousarray(cosines, dtype=np.float64).reshape(-1),
        angles.reshape(-1),
    )
    return angles


@kernel
def _fill_angles(y: Array, x: Array, out: Array) -> None:
    for i in range(out.size):
        out[i] = angle_of(y[i], x[i])


@kernel
def exp(x: float) -> float:
    """Return e to the power of ``x``; 0 and infinity outside the range of floats.

    The error is below 0.9 units in the last place of normal numbers.
    """
    if not x <= LARGEST:  # NaN, too
        return x if np.isnan(x) else math.inf
    if x < SMALLEST:
        return 0.0
    # e^x = 2^twos e^r with |r| <= log(2) / 2
    twos = np.floor(x / (LN2[0] + LN2[1]) + 0.5)
    high, low = x - twos * LN2[0], twos * LN2[1]
    r = high - low
    series = E8 + r * (E9 + r * (E10 + r * (E11 + r * (E12 + r * (E13 + r * E14)))))
    series = E2 + r * (E3 + r * (E4 + r * (E5 + r * (E6 + r * (E7 + r * series)))))
    return math.ldexp(1.0 + (high + (r * r * series - low)), int(twos))


@kernel
def log(x: float) -> float:
    """Return the natural logarithm of ``x``; minus infinity for 0, NaN below.

    With the mantissa ``1 + f`` between sqrt(1/2) and sqrt(2), and ``s = f / (2 + f)``, it is
    ``2 artanh(s) = f - s (f - R)``, ``R = 2 s^2/3 + 2 s^4/5 + ...``. The error is below
    0.9 units in the last place.
    """
    mantissa, exponent = math.frexp(x)
    is_low = mantissa < ROOT_HALF
    mantissa = where(is_low, 2.0 * mantissa, mantissa)
    twos = where(is_low, exponent - 1.0, exponent + 0.0)
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    rest = L6 + z * (L7 + z * (L8 + z * (L9 + z * (L10 + z * L11))))
    rest = z * (L1 + z * (L2 + z * (L3 + z * (L4 + z * (L5 + z * rest)))))
    half = 0.5 * f * f
    value = twos * LN2[0] - ((half - (s * (half + rest) + twos * LN2[1])) - f)
    # frexp has no mantissa for infinity and NaN
    value = where(x < math.inf, value, x)
    return where(x > 0.0, value, where(x == 0.0, -math.inf, math.nan))


@kernel
def in_steps(value: float, step: float) -> float:
    """Round ``value`` to the nearest whole multiple of ``step``; a step of 0 is none."""
    # the usual case, without a division
    if not any_lane(step > 0.0):
        return value
    spacing = where(step > 0.0, step, 1.0)
    rounded: float = spacing * np.floor(value / spacing + 0.5)
    return where(step > 0.0, rounded, value)
