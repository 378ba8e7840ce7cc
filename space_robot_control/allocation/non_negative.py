"""Non-negative least squares.

Lawson & Hanson, "Solving Least Squares Problems", 1974, chapter 23, on the normal equations: a
dozen columns of six rows are well enough conditioned, and the matrix of the columns is computed
once. The solution is basic, no more columns than rows are used: few thrusters fire, for longer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, shaped
from space_robot_msgs_py.samples import MOST_THRUSTERS

Array = NDArray[np.float64]

ZERO = 1e-10
"""Relative to their scale: smaller gradients and pivots count as zero."""
MOST_ROUNDS = 3 * MOST_THRUSTERS


class NonNegative(Record):
    """Matrix and memory of `solve`."""

    gram: Array = shaped(lambda n: (MOST_THRUSTERS, MOST_THRUSTERS), "``B^T B``")
    right: Array = shaped(lambda n: (MOST_THRUSTERS,), "``B^T b``")
    x: Array = shaped(lambda n: (MOST_THRUSTERS,), "The solution")
    is_used: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """1 for each column that the solution uses (P), else 0 (Z)."""
    trial: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Solution on the columns in use, whatever its signs."""
    factor: Array = shaped(lambda n: (MOST_THRUSTERS, MOST_THRUSTERS))
    """Cholesky factor of their matrix."""
    used: Array = shaped(lambda n: (MOST_THRUSTERS,), "Their numbers")


@kernel
def solve(problem: NonNegative, count: int) -> None:
    """Write the ``x`` (>= count,) >= 0 of least ``|B x - b|``."""
    gram, right, x, is_used = problem.gram, problem.right, problem.x, problem.is_used
    scale = 0.0
    for j in range(count):
        x[j] = 0.0
        is_used[j] = 0.0
        if gram[j, j] > 0.0:
            scale = max(scale, abs(right[j]) / np.sqrt(gram[j, j]))
    for _ in range(MOST_ROUNDS):
        best, chosen = ZERO * scale, -1
        for j in range(count):
            if is_used[j] != 0.0 or gram[j, j] == 0.0:
                continue
            gradient = right[j]
            for k in range(count):
                gradient -= gram[j, k] * x[k]
            # per unit length of the column, so that the choice does not depend on units
            gradient /= np.sqrt(gram[j, j])
            if gradient > best:
                best, chosen = gradient, j
        if chosen < 0:
            return
        is_used[chosen] = 1.0
        if not _solve_used(problem, count) or problem.trial[chosen] <= 0.0:
            is_used[chosen] = -1.0  # depends on the others: of no use to these
            continue
        _step(problem, count)
        for j in range(count):
            is_used[j] = max(is_used[j], 0.0)


@subroutine
def _step(problem: NonNegative, count: int) -> None:
    """Go towards the trial as far as no component becomes negative, until it is reached."""
    x, is_used, trial = problem.x, problem.is_used, problem.trial
    for _ in range(MOST_ROUNDS):
        share, first = 1.0, -1
        for j in range(count):
            if is_used[j] == 1.0 and trial[j] <= 0.0:
                part = x[j] / (x[j] - trial[j]) if x[j] > trial[j] else 0.0
                if part < share or first < 0:
                    share, first = min(part, share), j
        for j in range(count):
            if is_used[j] == 1.0:
                x[j] += share * (trial[j] - x[j])
        if first < 0:
            return
        for j in range(count):
            if is_used[j] == 1.0 and (j == first or x[j] <= 0.0):
                x[j] = 0.0
                is_used[j] = 0.0
        _solve_used(problem, count)


@subroutine
def _solve_used(problem: NonNegative, count: int) -> bool:
    """Solve on the columns in use by Cholesky's method; return False if they are dependent."""
    gram, factor, used, trial = problem.gram, problem.factor, problem.used, problem.trial
    size = 0
    for j in range(count):
        if problem.is_used[j] == 1.0:
            used[size] = j
            size += 1
    for a in range(size):
        i = int(used[a])
        for b in range(a + 1):
            total = gram[i, int(used[b])]
            for c in range(b):
                total -= factor[a, c] * factor[b, c]
            if a != b:
                factor[a, b] = total / factor[b, b]
            elif total > ZERO * gram[i, i]:
                factor[a, a] = np.sqrt(total)
            else:
                return False
    for a in range(size):
        total = problem.right[int(used[a])]
        for c in range(a):
            total -= factor[a, c] * trial[int(used[c])]
        trial[int(used[a])] = total / factor[a, a]
    for a in range(size - 1, -1, -1):
        total = trial[int(used[a])]
        for c in range(a + 1, size):
            total -= factor[c, a] * trial[int(used[c])]
        trial[int(used[a])] = total / factor[a, a]
    return True
