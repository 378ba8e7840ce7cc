"""The pseudo-inverse of a symmetric matrix of three rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine

Array = NDArray[np.float64]

LEAST_EIGENVALUE = 1e-8
"""Relative to the largest; smaller ones count as zero."""
MOST_SWEEPS = 20
"""Jacobi's method converges quadratically: some six sweeps are enough for three rows."""


@kernel
def pseudo_inverse(matrix: Array, vectors: Array, inverse: Array) -> int:
    """Write the pseudo-inverse of a symmetric, positive semidefinite matrix.

    By Jacobi's rotations (Golub & Van Loan, Matrix Computations, 8.5).

    Args:
        matrix: (3, 3), becomes diagonal.
        vectors: (3, 3), becomes the eigenvectors, one a column.
        inverse: (3, 3) to be written.

    Returns:
        The rank: number of eigenvalues above `LEAST_EIGENVALUE` of the largest.
    """
    for i in range(3):
        for j in range(3):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(MOST_SWEEPS):
        if matrix[0, 1] == 0.0 and matrix[0, 2] == 0.0 and matrix[1, 2] == 0.0:
            break
        for p, q in ((0, 1), (0, 2), (1, 2)):
            _rotate(matrix, vectors, p, q)
    largest = max(matrix[0, 0], matrix[1, 1], matrix[2, 2])
    rank = 0
    inverse[:] = 0.0
    for k in range(3):
        if largest > 0.0 and matrix[k, k] > LEAST_EIGENVALUE * largest:
            rank += 1
            for i in range(3):
                for j in range(3):
                    inverse[i, j] += vectors[i, k] * vectors[j, k] / matrix[k, k]
    return rank


@subroutine
def _rotate(matrix: Array, vectors: Array, p: int, q: int) -> None:
    """Make ``matrix[p, q]`` zero."""
    if matrix[p, q] == 0.0:
        return
    if abs(matrix[p, q]) < 1e-300 * max(abs(matrix[p, p]), abs(matrix[q, q])) or (
        matrix[p, p] + matrix[p, q] == matrix[p, p] and matrix[q, q] + matrix[p, q] == matrix[q, q]
    ):
        matrix[p, q] = 0.0
        matrix[q, p] = 0.0
        return
    ratio = (matrix[q, q] - matrix[p, p]) / (2.0 * matrix[p, q])
    side = 1.0 if ratio >= 0.0 else -1.0
    tangent = side / (abs(ratio) + np.sqrt(ratio * ratio + 1.0))
    cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
    sine = tangent * cosine
    for k in range(3):
        a, b = matrix[k, p], matrix[k, q]
        matrix[k, p], matrix[k, q] = cosine * a - sine * b, sine * a + cosine * b
    for k in range(3):
        a, b = matrix[p, k], matrix[q, k]
        matrix[p, k], matrix[q, k] = cosine * a - sine * b, sine * a + cosine * b
        a, b = vectors[k, p], vectors[k, q]
        vectors[k, p], vectors[k, q] = cosine * a - sine * b, sine * a + cosine * b
