"""Inertias whose mass is spread otherwise, in plain IEEE arithmetic.

LAPACK and BLAS choose their code, and so their last digits, by the processor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_model.elementary.matrices import product, rotate_tensor
from space_robot_model.elementary.symmetric import principal_axes

Array = NDArray[np.float64]


def rotation(turn: ArrayLike) -> Array:
    """Return a rotation about a vector, by 2 atan of half its length, rad: Cayley's form."""
    x, y, z = 0.5 * np.asarray(turn, dtype=np.float64)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    scale = 2.0 / (1.0 + (x * x + y * y + z * z))
    result: Array = np.eye(3) + scale * (cross + product(cross, cross))
    return result


def spread(inertia: Array, factors: ArrayLike, turn: ArrayLike) -> Array:
    """Return the inertia (3, 3) of a body whose mass is spread otherwise, and turned.

    The second moments of the mass, ``tr(I)/2 E - I``, are positive for every body there is. Each
    along its principal axes is multiplied by a positive factor, so the inertia that they make is
    again one that a body can have, whatever the factors.

    Args:
        inertia: (3, 3) kg m2, about the centre of mass.
        factors: (3,) above 0, of the second moments in ascending order.
        turn: (3,) rad, see `rotation`.
    """
    moments, axes = principal_axes(0.5 * _trace(inertia) * np.eye(3) - inertia)
    # of a plate or a rod some are 0, and may be less by rounding
    scaled = np.maximum(moments, 0.0) * np.asarray(factors, dtype=np.float64)
    second = rotate_tensor(product(rotation(turn), axes), np.diag(scaled))
    return _trace(second) * np.eye(3) - 0.5 * (second + second.T)


def _trace(matrix: Array) -> float:
    return float(matrix[0, 0] + matrix[1, 1] + matrix[2, 2])
