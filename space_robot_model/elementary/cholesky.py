"""Cholesky factorisation of symmetric positive definite matrices, in kernels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

Array = NDArray[np.float64]


@kernel
def cholesky_into(matrix: Array, first: int, factor: Array) -> None:
    """Write the lower triangle L of a block ``L L^T`` of ``matrix`` into ``factor``.

    Args:
        matrix: (first + n, first + n) or larger; only the lower triangle of the block is read.
        first: row and column where the block begins.
        factor: (n, n); only its lower triangle is written.
    """
    for j in range(len(factor)):
        for i in range(j, len(factor)):
            total = matrix[first + i, first + j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            factor[i, j] = np.sqrt(total) if i == j else total / factor[j, j]


@kernel
def solve_cholesky(factor: Array, right: Array) -> None:
    """Replace ``right`` (n,) by the solution x of ``L L^T x = right``."""
    for i in range(len(factor)):
        for k in range(i):
            right[i] -= factor[i, k] * right[k]
        right[i] /= factor[i, i]
    for step in range(len(factor)):
        row = len(factor) - 1 - step
        for k in range(row + 1, len(factor)):
            right[row] -= factor[k, row] * right[k]
        right[row] /= factor[row, row]
