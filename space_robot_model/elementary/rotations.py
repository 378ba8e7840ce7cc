"""Sine, cosine and arctangent in plain Python, and rotations by angles about fixed axes.

Importing Numba takes longer than all that a command without a flight does, so nothing here is
compiled; `functions` compiles them as kernels, with the same bits.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from space_robot_msgs_py.compiled.lanes import any_lane, where

from .matrices import Array, norm

TURNS = 2.0 / math.pi
"""Quarter turns per radian."""
QUARTER = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487111665e-21, 8.4784276603689e-32)
"""Parts of a quarter turn, rad: three of 33 bits, so that products with 20 bits are exact."""
EXACT_LIMIT = 1.6e6
"""Largest angle, rad, with at most 20 bits in its number of quarter turns."""
(S3, S5, S7, S9, S11, S13, S15, S17) = (
    (-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 9)
)
(C4, C6, C8, C10, C12, C14, C16) = ((-1.0) ** k / math.factorial(2 * k) for k in range(2, 9))
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
GIMBAL_LOCK = 1e-12
"""Cosine of the pitch below which the axes of roll and yaw coincide (gimbal lock)."""


def plain_sin_cos(angle: float) -> tuple[float, float]:
    """Return sine and cosine of ``angle``, rad; NaN if the angle is not finite.

    The error is below 0.8 units in the last place up to 1.6 million radians. Beyond, they are
    exact for an angle that differs from ``angle`` by less than the spacing of floats.
    """
    if any_lane(abs(angle) > EXACT_LIMIT):  # exact, by IEEE 754
        nearest = np.fmod(where(np.isfinite(angle), angle, 0.0), 2.0 * math.pi)
        nearest = where(np.isfinite(angle), nearest, math.nan)
        angle = where(abs(angle) > EXACT_LIMIT, nearest, angle)
    x, rest, quarter = angle, 0.0, 0.0
    is_large = abs(angle) > 0.25 * math.pi
    if any_lane(is_large):
        # subtract quarter turns, part by part, with exact rounding errors (Knuth's two-sum)
        turns = where(is_large, np.floor(angle * TURNS + 0.5), 0.0)
        a, b = angle - turns * QUARTER[0], turns * QUARTER[1]
        x = a - b
        other = x - a
        rest = (a - (x - other)) - (b + other)
        a, b = x, turns * QUARTER[2]
        x = a - b
        other = x - a
        rest = rest + ((a - (x - other)) - (b + other)) - turns * QUARTER[3]
        x, rest = x + rest, (x - (x + rest)) + rest
        quarter = turns - 4.0 * np.floor(0.25 * turns)
    z = x * x  # Taylor's series up to an eighth of a turn
    series = S5 + z * (S7 + z * (S9 + z * (S11 + z * (S13 + z * (S15 + z * S17)))))
    sine = x + (z * x * (S3 + z * series) + rest * (1.0 - 0.5 * z))
    half = 0.5 * z
    large = 1.0 - half
    series = z * z * (C4 + z * (C6 + z * (C8 + z * (C10 + z * (C12 + z * (C14 + z * C16))))))
    cosine = large + (((1.0 - large) - half) + (series - x * rest))
    is_odd = (quarter == 1.0) | (quarter == 3.0)
    first, second = where(is_odd, cosine, sine), where(is_odd, sine, cosine)
    is_behind = (quarter == 1.0) | (quarter == 2.0)
    return where(quarter >= 2.0, -first, first), where(is_behind, -second, second)


def plain_angle_of(y: float, x: float) -> float:
    """Return the angle of the point (x, y), rad, from -pi to pi; NaN if it is not finite.

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
        # pi/2 is not a float: its rounding error is added before the sum is rounded
        angle = 0.5 * math.pi - (angle - REST_OF_HALF_PI)
    # the sign of a zero counts, as in C
    if math.copysign(1.0, x) < 0.0:
        angle = math.pi - (angle - 2.0 * REST_OF_HALF_PI)
    return math.copysign(angle, y)


def exact_sines_cosines(angles: ArrayLike) -> tuple[Array, Array]:
    """Return sines and cosines of angles, rad; exact for multiples of a right angle."""
    values = np.asarray(angles, dtype=np.float64)
    pairs = np.array([plain_sin_cos(float(angle)) for angle in values.flat])
    exact = _exact(pairs.reshape(*values.shape, 2))
    return exact[..., 0], exact[..., 1]


def rotation_of_rpy(rpy: ArrayLike) -> Array:
    """Return ``Rz(yaw) Ry(pitch) Rx(roll)`` (3, 3) of angles (rad) about fixed axes x, y, z."""
    (sr, sp, sy), (cr, cp, cy) = exact_sines_cosines(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rpy_of_rotation(rotation: Array) -> Array:
    """Return roll, pitch, yaw, rad, of a rotation matrix (3, 3); yaw is 0 at gimbal lock.

    Yaw is computed first, then roll from the rotation without yaw: near gimbal lock both are
    inaccurate, but their combination is accurate to rounding.
    """
    level = norm(rotation[:2, 0])
    yaw = plain_angle_of(rotation[1, 0], rotation[0, 0]) if level > GIMBAL_LOCK else 0.0
    s, c = exact_sines_cosines(yaw)
    across = c * rotation[1] - s * rotation[0]
    return np.array(
        [plain_angle_of(-across[2], across[1]), plain_angle_of(-rotation[2, 0], level), yaw]
    )


def _exact(values: Array) -> Array:
    rounded = np.round(values)
    return np.where(np.abs(values - rounded) < 1e-15, rounded, values)


def quaternion_of_rotation(rotation: Array) -> Array:
    """Return the unit quaternion ``[w, x, y, z]`` of a rotation (3, 3), with the largest part > 0.

    The part that is largest is taken from the diagonal (Shepperd 1978).
    """
    r = rotation
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    squares = np.array([trace, r[0, 0], r[1, 1], r[2, 2]])
    largest = int(np.argmax(squares))
    q = np.empty(4)
    if largest == 0:
        q[0] = 1.0 + trace
        q[1:] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q[1 + i] = 1.0 + 2.0 * r[i, i] - trace
        q[0] = r[k, j] - r[j, k]
        q[1 + j], q[1 + k] = r[j, i] + r[i, j], r[k, i] + r[i, k]
    unit: Array = q / norm(q)
    return unit
