"""Operations on small matrices, summed term by term in a fixed order.

NumPy uses BLAS and LAPACK, whose order of summation depends on the processor.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

LEAST_NORM, MOST_NORM = 1e-3, 1e3
"""Norms of what is written as a direction or quaternion, and scaled to 1."""


def product(a: ArrayLike, b: ArrayLike) -> Array:
    """Return ``a @ b`` for vectors and matrices; ``a`` may be a stack of them."""
    left, right = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    result = np.zeros(left.shape[:-1] + right.shape[1:])
    # term by term: the same order on every processor
    for k in range(len(right)):
        column = left[..., k]
        result += column * right[k] if right.ndim == 1 else column[..., np.newaxis] * right[k]
    return result


def rotate_tensor(rotation: Array, tensor: Array) -> Array:
    """Return ``R T R^T``."""
    return product(product(rotation, tensor), rotation.T)


def norm(vector: ArrayLike) -> float:
    """Return the Euclidean norm of a vector; the squares must not overflow."""
    return math.sqrt(product(np.ravel(vector), np.ravel(vector)))


@np.errstate(over="ignore")
def direction_norm(vector: ArrayLike, what: str) -> float:
    """Return the norm of a vector that is going to be divided by it.

    Raises:
        InputError: it is too short or too long for that; names ``what``.
    """
    length = norm(vector)
    if not LEAST_NORM <= length <= MOST_NORM:
        raise InputError(
            f"{what} must have a norm of {LEAST_NORM:g} to {MOST_NORM:g} (it is scaled to 1), "
            f"not {length:g}"
        )
    return length


def dot_rows(a: Array, b: Array) -> Array:
    """Return the dot products (..., 1) of the last axis."""
    total = a[..., 0] * b[..., 0]
    for k in range(1, a.shape[-1]):
        total = total + a[..., k] * b[..., k]
    return total[..., np.newaxis]


def norms(rows: Array) -> Array:
    """Return the Euclidean norms (...) of the last axis."""
    lengths: Array = np.sqrt(dot_rows(rows, rows)[..., 0])
    return lengths


def unit_rows(rows: Array) -> Array:
    """Return ``rows`` divided by their norms along the last axis."""
    unit: Array = rows / norms(rows)[..., np.newaxis]
    return unit


def solve(matrix: Array, right: Array) -> Array:
    """Solve ``matrix x = right`` by Gaussian elimination with partial pivoting.

    Args:
        matrix: (n, n), not singular.
        right: (n,) or (n, m).
    """
    size = len(matrix)
    a, x = matrix.astype(np.float64), right.astype(np.float64)
    for k in range(size):
        pivot = k + int(np.argmax(np.abs(a[k:, k])))
        a[[k, pivot]], x[[k, pivot]] = a[[pivot, k]], x[[pivot, k]]
        for i in range(k + 1, size):
            factor = a[i, k] / a[k, k]
            a[i] -= factor * a[k]
            x[i] -= factor * x[k]
    for k in reversed(range(size)):
        for j in range(k + 1, size):
            x[k] -= a[k, j] * x[j]
        x[k] /= a[k, k]
    return x
