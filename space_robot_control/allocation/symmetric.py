"""The pseudo-inverse of a symmetric matrix of three rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.symmetric import diagonalise
from space_robot_msgs_py.compiled.kernels import kernel

Array = NDArray[np.float64]

LEAST_EIGENVALUE = 1e-8
"""Relative to the largest; smaller ones count as zero."""


@kernel
def pseudo_inverse(matrix: Array, vectors: Array, inverse: Array) -> int:
    """Write the pseudo-inverse of a symmetric, positive semidefinite matrix.

    Args:
        matrix: (3, 3), becomes diagonal.
        vectors: (3, 3), becomes the eigenvectors, one a column.
        inverse: (3, 3) to be written.

    Returns:
        The rank: number of eigenvalues above `LEAST_EIGENVALUE` of the largest.
    """
    diagonalise(matrix, vectors)
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
