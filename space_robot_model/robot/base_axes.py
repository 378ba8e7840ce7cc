"""Vectors of many ticks at once, turned between the base's axes and the inertial ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def base_axes(quaternion: Array) -> Array:
    """Return the base's axes x, y, z on inertial axes, (3, 3, N), of (4, N) ``[w, x, y, z]``."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def to_inertial(axes: Array, vectors: Array) -> Array:
    """Turn vectors (3, N) on the base's ``axes``, see `base_axes`, to inertial axes, (3, N)."""
    turned: Array = axes[0] * vectors[0] + axes[1] * vectors[1] + axes[2] * vectors[2]
    return turned


def to_base(axes: Array, vectors: Array) -> Array:
    """Turn vectors (3, N) on inertial axes to the base's ``axes``, see `base_axes`, (3, N)."""
    turned: Array = axes[:, 0] * vectors[0] + axes[:, 1] * vectors[1] + axes[:, 2] * vectors[2]
    return turned


def cross(a: Array, b: Array) -> Array:
    """Return ``a x b`` of vectors (3, N), faster than NumPy's over short rows."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
