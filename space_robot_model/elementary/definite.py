"""The nearest symmetric matrix above or below a bound, in the order of definite matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import all_lanes, where

from .symmetric import diagonalise

Array = NDArray[np.float64]

SMALLEST_EIGENVALUE = 1e-12
"""Of a matrix moved to a bound, relative to the largest: positive definite beyond rounding."""


@kernel
def is_positive_definite(matrix: Array) -> bool:
    """Return whether a symmetric matrix (n, n) is positive definite; its upper half is used up.

    By the pivots of Gaussian elimination.
    """
    size = matrix.shape[0]
    is_definite: bool = matrix[0, 0] > 0.0
    for j in range(size):
        is_positive = matrix[j, j] > 0.0
        is_definite = is_definite & is_positive
        inverse = 1.0 / where(is_positive, matrix[j, j], 1.0)
        for i in range(j + 1, size):
            factor = matrix[j, i] * inverse
            for k in range(i, size):
                matrix[i, k] -= factor * matrix[j, k]
    return is_definite


@kernel
def move_to_side(
    matrix: Array, bound: Array, side: float, root: Array, work: Array, vectors: Array
) -> None:
    """Replace ``matrix`` by the nearest one for which ``side (matrix - bound)`` is definite.

    Positive definite, that is: ``side`` 1 moves it above the bound, -1 below. The distance is the
    Frobenius norm of ``root^-1 (A - B) root^-T``. In it the move is the projection onto a convex
    cone (Higham, Linear Algebra and its Applications 103, 1988), so no matrix on that side becomes
    more distant. A matrix on that side is left as it is, without much work.

    Args:
        matrix: (n, n) symmetric.
        bound: (n, n) symmetric.
        side: 1 or -1.
        root: (n, n) lower triangular, not singular.
        work: (n, n) scratch.
        vectors: (n, n) scratch.
    """
    size = matrix.shape[0]
    for i in range(size):
        for j in range(size):
            work[i, j] = side * (matrix[i, j] - bound[i, j])
    is_definite = is_positive_definite(work)
    if all_lanes(is_definite):
        return
    for i in range(size):
        for j in range(size):
            work[i, j] = side * (matrix[i, j] - bound[i, j])
    normalise(work, root)
    diagonalise(work, vectors)
    largest = work[0, 0]
    for e in range(1, size):
        largest = where(work[e, e] > largest, work[e, e], largest)
    for e in range(size):
        lack = SMALLEST_EIGENVALUE * largest - work[e, e]
        work[e, e] = where(lack > 0.0, lack, 0.0)
        for i in range(size - 1, -1, -1):
            total = root[i, 0] * vectors[0, e]
            for k in range(1, i + 1):
                total += root[i, k] * vectors[k, e]
            vectors[i, e] = total
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for e in range(size):
                total += side * work[e, e] * vectors[i, e] * vectors[j, e]
            matrix[i, j] = where(is_definite, matrix[i, j], total)
            matrix[j, i] = matrix[i, j]


@kernel
def normalise(matrix: Array, root: Array) -> None:
    """Replace the symmetric ``matrix`` (n, n) by ``root^-1 matrix root^-T``."""
    size = matrix.shape[0]
    for i in range(size):
        inverse = 1.0 / root[i, i]
        for j in range(size):
            total = matrix[i, j]
            for k in range(i):
                total -= root[i, k] * matrix[k, j]
            matrix[i, j] = total * inverse
    for j in range(size):
        inverse = 1.0 / root[j, j]
        for i in range(size):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * root[j, k]
            matrix[i, j] = total * inverse
    for i in range(size):
        for j in range(i):
            mean = 0.5 * (matrix[i, j] + matrix[j, i])
            matrix[i, j] = matrix[j, i] = mean
