"""Rotations by angles about fixed axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .matrices import norm
from .series import plain_sin_cos

Array = NDArray[np.float64]

GIMBAL_LOCK = 1e-12
"""Cosine of the pitch below which the axes of roll and yaw coincide (gimbal lock)."""


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
    from .arctangent import arctan2  # slow to import

    level = norm(rotation[:2, 0])
    yaw = arctan2(rotation[1, 0], rotation[0, 0]) if level > GIMBAL_LOCK else 0.0
    s, c = exact_sines_cosines(yaw)
    across = c * rotation[1] - s * rotation[0]
    return np.array([arctan2(-across[2], across[1]), arctan2(-rotation[2, 0], level), yaw])


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
