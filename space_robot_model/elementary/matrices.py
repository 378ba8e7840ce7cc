"""Products of small matrices and what comes of them, term by term in one order.

NumPy hands these to a BLAS and a LAPACK, which sum in another order on another processor.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

MOST_SWEEPS = 30
"""Of Jacobi's method; it needs less than ten."""


def product(a: ArrayLike, b: ArrayLike) -> Array:
    """Return ``a @ b`` of vectors, matrices, or a stack of them in ``a``."""
    left, right = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    result = np.zeros(left.shape[:-1] + right.shape[1:])
    for k in range(len(right)):
        column = left[..., k]
        result += column * right[k] if right.ndim == 1 else column[..., np.newaxis] * right[k]
    return result


def rotate_tensor(rotation: Array, tensor: Array) -> Array:
    """Return ``R T R^T``."""
    return product(product(rotation, tensor), rotation.T)


def norm(vector: ArrayLike) -> float:
    """Return the length of a vector; its numbers' squares must be numbers, too."""
    return math.sqrt(product(np.ravel(vector), np.ravel(vector)))


def solve(matrix: Array, right: Array) -> Array:
    """Return x of ``matrix x = right``, by Gauss's elimination with pivots of its column.

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


def principal_axes(tensor: Array) -> tuple[Array, Array]:
    """Return the eigenvalues of a symmetric matrix (n, n), rising, and its axes as columns.

    Jacobi's method: turn by turn in a plane until nothing is left off the diagonal.
    """
    a, axes = 0.5 * (tensor + tensor.T), np.eye(len(tensor))
    pairs = [(p, q) for p in range(len(a)) for q in range(p + 1, len(a))]
    for _ in range(MOST_SWEEPS):
        if not any(a[p, q] for p, q in pairs):
            break
        for p, q in pairs:
            if a[p, q] == 0.0:
                continue
            if abs(a[p, q]) < 1e-18 * min(abs(a[p, p]), abs(a[q, q])):
                a[p, q] = a[q, p] = 0.0
                continue
            half = 0.5 * (a[q, q] - a[p, p]) / a[p, q]
            tangent = math.copysign(1.0, half) / (abs(half) + math.sqrt(half * half + 1.0))
            cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
            turn = np.eye(len(a))
            turn[p, p] = turn[q, q] = cosine
            turn[p, q], turn[q, p] = tangent * cosine, -tangent * cosine
            a, axes = rotate_tensor(turn.T, a), product(axes, turn)
            a[p, q] = a[q, p] = 0.0
    order = np.argsort(np.diagonal(a), kind="stable")
    return np.diagonal(a)[order], axes[:, order]
