"""Eigenvalues and eigenvectors of symmetric matrices, the same bits on every processor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import all_lanes, where

Array = NDArray[np.float64]

MOST_SWEEPS = 20
"""Maximum number of sweeps; Jacobi's method needs about six for a (3, 3) matrix."""


@kernel
def diagonalise(matrix: Array, vectors: Array) -> None:
    """Diagonalise a symmetric matrix by Jacobi rotations.

    Golub & Van Loan, Matrix Computations, 8.5.

    Args:
        matrix: (n, n), replaced by the diagonal matrix of eigenvalues, in no order.
        vectors: (n, n), replaced by the eigenvectors, as columns.
    """
    n = len(matrix)
    for i in range(n):
        for j in range(n):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(MOST_SWEEPS):
        is_diagonal = matrix[0, 0] == matrix[0, 0]
        for p in range(n):
            for q in range(p + 1, n):
                is_diagonal = is_diagonal & (matrix[p, q] == 0.0)
        if all_lanes(is_diagonal):
            break
        for p in range(n):
            for q in range(p + 1, n):
                _rotate(matrix, vectors, p, q)


@subroutine
def _rotate(matrix: Array, vectors: Array, p: int, q: int) -> None:
    """Apply the rotation that makes ``matrix[p, q]`` zero."""
    off, first, second = matrix[p, q], matrix[p, p], matrix[q, q]
    is_small = (abs(off) < 1e-300 * max(abs(first), abs(second))) | (off == 0.0)
    is_small = is_small | ((first + off == first) & (second + off == second))
    if all_lanes(is_small):
        matrix[p, q] = matrix[q, p] = 0.0
        return
    ratio = (second - first) / where(is_small, 1.0, 2.0 * off)
    side = where(ratio >= 0.0, 1.0, -1.0)
    tangent = side / (abs(ratio) + np.sqrt(ratio * ratio + 1.0))
    cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
    sine = tangent * cosine
    for k in range(len(matrix)):
        a, b = matrix[k, p], matrix[k, q]
        matrix[k, p] = where(is_small, a, cosine * a - sine * b)
        matrix[k, q] = where(is_small, b, sine * a + cosine * b)
    for k in range(len(matrix)):
        a, b = matrix[p, k], matrix[q, k]
        matrix[p, k] = where(is_small, a, cosine * a - sine * b)
        matrix[q, k] = where(is_small, b, sine * a + cosine * b)
        a, b = vectors[k, p], vectors[k, q]
        vectors[k, p] = where(is_small, a, cosine * a - sine * b)
        vectors[k, q] = where(is_small, b, sine * a + cosine * b)
    matrix[p, q] = where(is_small, 0.0, matrix[p, q])
    matrix[q, p] = where(is_small, 0.0, matrix[q, p])


def principal_axes(tensor: Array) -> tuple[Array, Array]:
    """Return ascending eigenvalues and eigenvectors (columns) of a symmetric matrix (n, n)."""
    matrix = 0.5 * (tensor + tensor.T)
    axes = np.empty_like(matrix)
    diagonalise(matrix, axes)
    order = np.argsort(np.diagonal(matrix), kind="stable")
    return np.diagonal(matrix)[order], axes[:, order]
