"""Cholesky factorisation of symmetric positive definite matrices, in kernels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

Array = NDArray[np.float64]


@kernel
def cholesky_into(matrix: Array, factor: Array) -> None:
    """Write the lower triangle L of ``matrix = L L^T`` into ``factor``; both (n, n).

    Only the lower triangle of ``matrix`` is read, and only that of ``factor`` is written.
    """
    for j in range(len(factor)):
        for i in range(j, len(factor)):
            total = matrix[i, j]
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
        i = len(factor) - 1 - step
        for k in range(i + 1, len(factor)):
            right[i] -= factor[k, i] * right[k]
        right[i] /= factor[i, i]
