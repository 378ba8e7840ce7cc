"""Rotation of vectors between base and inertial frame, for many ticks at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def base_axes(quaternion: Array) -> Array:
    """Return the base's axes x, y, z in inertial axes, (3, 3, N), of (4, N) ``[w, x, y, z]``."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def to_inertial(axes: Array, vectors: Array) -> Array:
    """Rotate vectors (3, N) from base to inertial axes, (3, N); ``axes`` of `base_axes`."""
    turned: Array = axes[0] * vectors[0] + axes[1] * vectors[1] + axes[2] * vectors[2]
    return turned


def to_base(axes: Array, vectors: Array) -> Array:
    """Rotate vectors (3, N) from inertial to base axes, (3, N); ``axes`` of `base_axes`."""
    turned: Array = axes[:, 0] * vectors[0] + axes[:, 1] * vectors[1] + axes[:, 2] * vectors[2]
    return turned


def cross(a: Array, b: Array) -> Array:
    """Return ``a x b`` of vectors (3, N), faster than NumPy for short rows."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
