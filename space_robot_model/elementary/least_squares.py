"""Least-squares solutions of small systems, with the same bits on every processor.

NumPy hands these to LAPACK, which sums in another order on another processor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .matrices import product
from .symmetric import principal_axes

Array = NDArray[np.float64]

RANK_TOLERANCE = 1e-7
"""Singular values below this share of the largest count as zero."""


@kernel
def least_squares_into(
    matrix: Array, right: Array, damping: float, work: Array, solution: Array
) -> None:
    """Write ``A^T (A A^T + damping^2 E)^-1 b``, the smallest x with ``A x = b``, by Cholesky.

    Args:
        matrix: A (m, n), m at most n.
        right: b (m,).
        damping: 0 for full rank; above 0 for the damped solution (Nakamura & Hanafusa 1986).
        work: (m, n) scratch, at least (m, m+1).
        solution: x (n,). It is not finite if A has not full rank and ``damping`` is 0.
    """
    m, n = matrix.shape
    for i in range(m):
        for j in range(i + 1):
            total = damping * damping if i == j else 0.0
            for k in range(n):
                total += matrix[i, k] * matrix[j, k]
            for k in range(j):
                total -= work[i, k] * work[j, k]
            work[i, j] = np.sqrt(total) if i == j else total / work[j, j]
    for i in range(m):
        total = right[i]
        for k in range(i):
            total -= work[i, k] * work[k, m]
        work[i, m] = total / work[i, i]
    for i in range(m - 1, -1, -1):
        total = work[i, m]
        for k in range(i + 1, m):
            total -= work[k, i] * work[k, m]
        work[i, m] = total / work[i, i]
    for k in range(n):
        solution[k] = 0.0
        for i in range(m):
            solution[k] += matrix[i, k] * work[i, m]


def singular_values(matrix: Array) -> Array:
    """Return the singular values of A (m, n), rising, m of them."""
    values, _ = principal_axes(product(matrix, matrix.T))
    return np.sqrt(np.maximum(values, 0.0))


def null_space(matrix: Array) -> Array:
    """Return an orthonormal basis of the null space of A (m, n), a column each.

    Singular values below `RANK_TOLERANCE` of the largest count as zero.
    """
    values, axes = principal_axes(product(matrix.T, matrix))
    largest = max(float(values[-1]), 0.0) if len(values) else 0.0
    basis: Array = axes[:, values <= RANK_TOLERANCE * RANK_TOLERANCE * largest]
    return basis
