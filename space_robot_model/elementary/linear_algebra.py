"""Factorisations, least squares and eigenvalues of small matrices, in kernels.

NumPy hands these to LAPACK, which sums in another order on another processor.
"""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import all_lanes, where

from .matrices import Array

MOST_SWEEPS = 20
"""Maximum number of sweeps; Jacobi's method needs about six for a (3, 3) matrix."""
SMALLEST_EIGENVALUE = 1e-12
"""Of a matrix moved to a bound, relative to the largest: positive definite beyond rounding."""


@kernel
def cholesky_into(matrix: Array, first: int, factor: Array) -> None:
    """Write the lower triangle L of a block ``L L^T`` of ``matrix`` into ``factor``.

    Args:
        matrix: (first + n, first + n) or larger; only the lower triangle of the block is read.
        first: row and column where the block begins.
        factor: (n, n); only its lower triangle is written. It may be ``matrix``, from 0 on.
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


@kernel
def least_squares_into(matrix: Array, right: Array, work: Array, solution: Array) -> None:
    """Write ``A^T (A A^T)^-1 b``, the smallest x with ``A x = b``, by Cholesky.

    Args:
        matrix: A (m, n), m at most n.
        right: b (m,).
        work: (m, m+1) scratch, or larger.
        solution: x (n,). It is not finite if A has not full rank.
    """
    m, n = matrix.shape
    factor, multipliers = work[:m, :m], work[:m, m]
    for i in range(m):
        multipliers[i] = right[i]
        for j in range(i + 1):
            factor[i, j] = 0.0
            for k in range(n):
                factor[i, j] += matrix[i, k] * matrix[j, k]
    cholesky_into(factor, 0, factor)
    solve_cholesky(factor, multipliers)
    for k in range(n):
        solution[k] = 0.0
        for i in range(m):
            solution[k] += matrix[i, k] * multipliers[i]


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
    cholesky_into(weight, 0, weight)
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
    off, first, second = matrix[p, q], matrix[p, p], matrix[q, q]
    # what is rounded away beside both eigenvalues, or would overflow the ratio, counts as zero
    is_small = (abs(off) < 1e-300 * max(abs(first), abs(second))) | (off == 0.0)
    is_small = is_small | ((first + off == first) & (second + off == second))
    if all_lanes(is_small):
        matrix[p, q] = matrix[q, p] = 0.0
        return
    ratio = (second - first) / where(is_small, 1.0, 2.0 * off)
    side = where(ratio >= 0.0, 1.0, -1.0)
    # the smaller of the two angles that make the element zero
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
    # on that side already: no eigenvalues are needed
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
            # rounding has made it unsymmetric, and rotations read both halves
            mean = 0.5 * (matrix[i, j] + matrix[j, i])
            matrix[i, j] = matrix[j, i] = mean
