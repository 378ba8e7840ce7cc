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
def least_squares_into(matrix: Array, right: Array, work: Array, solution: Array) -> None:
    """Write ``A^T (A A^T)^-1 b``, the smallest x with ``A x = b``, by Cholesky.

    Args:
        matrix: A (m, n), m at most n.
        right: b (m,).
        work: (m, m+1) scratch.
        solution: x (n,). It is not finite if A has not full rank.
    """
    m, n = matrix.shape
    for i in range(m):
        for j in range(i + 1):
            total = 0.0
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


@kernel
def weighted_least_squares_into(
    matrix: Array, right: Array, weight: Array, scaled: Array, work: Array, solution: Array
) -> None:
    """Write the x with ``A x = b`` and the smallest ``x^T W x``, by Cholesky of W.

    Args:
        matrix: A (m, n) of full rank, m at most n.
        right: b (m,).
        weight: W (n, n), symmetric, positive definite; its lower triangle becomes its factor.
        scaled: (m, n) scratch.
        work: (m, m+1) scratch.
        solution: x (n,).
    """
    m, n = matrix.shape
    for i in range(n):
        for j in range(i + 1):
            total = weight[i, j]
            for k in range(j):
                total -= weight[i, k] * weight[j, k]
            weight[i, j] = np.sqrt(total) if i == j else total / weight[j, j]
    for row in range(m):
        for i in range(n):
            total = matrix[row, i]
            for k in range(i):
                total -= weight[i, k] * scaled[row, k]
            scaled[row, i] = total / weight[i, i]
    least_squares_into(scaled, right, work, solution)
    for i in range(n - 1, -1, -1):
        total = solution[i]
        for k in range(i + 1, n):
            total -= weight[k, i] * solution[k]
        solution[i] = total / weight[i, i]


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
