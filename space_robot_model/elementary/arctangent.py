"""Four-quadrant arctangent."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.compiled.kernels import kernel

Array = NDArray[np.float64]

OF_QUARTERS = (0.0, 0.24497866312686414, 0.4636476090008061, 0.6435011087932844, 0.7853981633974483)
"""Arctangents of 0, 1/4, 1/2, 3/4 and 1, rad."""
REST_OF_QUARTERS = (
    0.0,
    1.0698755618734451e-17,
    2.2698777452961687e-17,
    1.5834785051444286e-17,
    3.061616997868383e-17,
)
"""Rounding errors of these constants, rad."""
REST_OF_HALF_PI = 6.123233995736766e-17
(A3, A5, A7, A9, A11, A13, A15, A17, A19) = ((-1.0) ** k / (2 * k + 1) for k in range(1, 10))


def arctan2(y: ArrayLike, x: ArrayLike) -> Array:
    """Return the angles of points (x, y), rad, from -pi to pi, in the shape of ``y`` and ``x``."""
    sines, cosines = np.broadcast_arrays(y, x)
    angles = np.empty(sines.shape)
    _fill(
        np.ascontiguousarray(sines, dtype=np.float64).reshape(-1),
        np.ascontiguousarray(cosines, dtype=np.float64).reshape(-1),
        angles.reshape(-1),
    )
    return angles


@kernel
def _fill(y: Array, x: Array, out: Array) -> None:
    for i in range(out.size):
        out[i] = angle_of(y[i], x[i])


@kernel
def angle_of(y: float, x: float) -> float:
    """Return `arctan2` of one point, rad, for kernels; NaN if the point is not finite.

    With c the multiple of 1/4 nearest to the tangent t,
    ``arctan t = arctan c + arctan (t - c)/(1 + c t)``, and the second term is a Taylor series. The
    error is below 2 units in the last place.
    """
    if not (math.isfinite(x) and math.isfinite(y)):
        return math.nan
    small, large = min(abs(x), abs(y)), max(abs(x), abs(y))
    if large == 0.0:
        angle = 0.0
    else:
        number = int(4.0 * (small / large) + 0.5) if small < large else 4
        quarter = 0.25 * number
        r = (small - quarter * large) / (large + quarter * small)
        z = r * r
        series = A11 + z * (A13 + z * (A15 + z * (A17 + z * A19)))
        series = A3 + z * (A5 + z * (A7 + z * (A9 + z * series)))
        angle = OF_QUARTERS[number] + (REST_OF_QUARTERS[number] + (r + r * z * series))
    if abs(y) > abs(x):
        angle = 0.5 * math.pi - (angle - REST_OF_HALF_PI)
    if math.copysign(1.0, x) < 0.0:
        angle = math.pi - (angle - 2.0 * REST_OF_HALF_PI)
    return math.copysign(angle, y)
