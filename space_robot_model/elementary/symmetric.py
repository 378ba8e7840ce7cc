"""Eigenvalues and eigenvectors of symmetric matrices, the same bits on every processor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine

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
        is_diagonal = True
        for p in range(n):
            for q in range(p + 1, n):
                is_diagonal = is_diagonal and matrix[p, q] == 0.0
        if is_diagonal:
            break
        for p in range(n):
            for q in range(p + 1, n):
                _rotate(matrix, vectors, p, q)


@subroutine
def _rotate(matrix: Array, vectors: Array, p: int, q: int) -> None:
    """Apply the rotation that makes ``matrix[p, q]`` zero."""
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
    for k in range(len(matrix)):
        a, b = matrix[k, p], matrix[k, q]
        matrix[k, p], matrix[k, q] = cosine * a - sine * b, sine * a + cosine * b
    for k in range(len(matrix)):
        a, b = matrix[p, k], matrix[q, k]
        matrix[p, k], matrix[q, k] = cosine * a - sine * b, sine * a + cosine * b
        a, b = vectors[k, p], vectors[k, q]
        vectors[k, p], vectors[k, q] = cosine * a - sine * b, sine * a + cosine * b


def principal_axes(tensor: Array) -> tuple[Array, Array]:
    """Return ascending eigenvalues and eigenvectors (columns) of a symmetric matrix (n, n)."""
    matrix = 0.5 * (tensor + tensor.T)
    axes = np.empty_like(matrix)
    diagonalise(matrix, axes)
    order = np.argsort(np.diagonal(matrix), kind="stable")
    return np.diagonal(matrix)[order], axes[:, order]
