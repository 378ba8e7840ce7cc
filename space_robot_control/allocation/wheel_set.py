"""Set of wheels that share a torque, with tables computed from their axes.

Motor torques u (W,) on wheels with unit axes a_k turn the base with ``-sum a_k u_k = -A u``. Which
u gives a torque is not unique with more than three wheels. The tables are computed again only
when a wheel is excluded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.linear_algebra import diagonalise
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, shaped
from space_robot_msgs_py.samples import MOST_WHEELS

Array = NDArray[np.float64]

MOST_PAIRS = MOST_WHEELS * (MOST_WHEELS - 1) // 2
LEAST_SINE = 1e-9
"""Directions at a smaller angle count as parallel."""
LEAST_PART = 0.05
"""Relative to the largest: a wheel with a smaller part of the null motion cannot be helped."""


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


class WheelSet(Record):
    """A subset of the wheels, with its tables."""

    takes_part: Array = shaped(lambda n: (MOST_WHEELS,))
    """1 for each wheel in the set, else 0."""
    column: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Axis times full load, N m; 0 for a wheel that takes no part."""
    full_load: Array = shaped(lambda n: (MOST_WHEELS,))
    """Torque in which the load of each wheel is measured, N m."""
    rank: float = shaped(lambda n: ())
    """Number of independent axes."""
    inverse: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """``A^+`` of least ``sum (u_k / full load)^2``; 1."""
    beyond: Array = shaped(lambda n: (3, 3))
    """Projector onto the torques that the set cannot give."""
    pairs: float = shaped(lambda n: ())
    """Number of rows in use of the following tables."""
    facet: Array = shaped(lambda n: (MOST_PAIRS, 3))
    """Normal of each facet of the largest torques, over its distance from the origin, 1/(N m)."""
    null: Array = shaped(lambda n: (MOST_WHEELS,))
    """Momenta that cancel one another, the largest part 1; 0 where there is none."""
    matrix: Array = shaped(lambda n: (3, 3, 3))
    """Scratch."""


@kernel
def tabulate(wheels: WheelSet, axis: Array, count: int) -> None:
    """Compute the tables of the wheels that take part; rows of ``axis`` are unit vectors."""
    for k in range(MOST_WHEELS):
        part = k < count and wheels.takes_part[k] == 1.0
        for i in range(3):
            wheels.column[k, i] = axis[k, i] * wheels.full_load[k] if part else 0.0
    matrix, vectors, inverse = wheels.matrix[0], wheels.matrix[1], wheels.matrix[2]
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(count):
                total += wheels.column[k, i] * wheels.column[k, j]
            matrix[i, j] = total
    wheels.rank = pseudo_inverse(matrix, vectors, inverse)
    for k in range(MOST_WHEELS):
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += wheels.column[k, j] * inverse[j, i]
            wheels.inverse[k, i] = total * wheels.full_load[k]
    largest = max(matrix[0, 0], matrix[1, 1], matrix[2, 2])
    wheels.beyond[:] = 0.0
    for k in range(3):
        if wheels.rank < 3.0 and not (largest > 0.0 and matrix[k, k] > LEAST_EIGENVALUE * largest):
            for i in range(3):
                for j in range(3):
                    wheels.beyond[i, j] += vectors[i, k] * vectors[j, k]
    _tabulate_facets(wheels, count)
    _tabulate_null(wheels, axis, count)


@subroutine
def _tabulate_facets(wheels: WheelSet, count: int) -> None:
    """Two wheels each span a facet: the torques at which all others have full load."""
    wheels.pairs = 0.0
    if wheels.rank < 3.0:
        return
    column = wheels.column
    for i in range(count):
        for j in range(i + 1, count):
            x = column[i, 1] * column[j, 2] - column[i, 2] * column[j, 1]
            y = column[i, 2] * column[j, 0] - column[i, 0] * column[j, 2]
            z = column[i, 0] * column[j, 1] - column[i, 1] * column[j, 0]
            size, load = x * x + y * y + z * z, wheels.full_load[i] * wheels.full_load[j]
            least = LEAST_SINE * load
            if not size > least * least:  # parallel, or one of them is out
                continue
            distance = 0.0
            for k in range(count):
                distance += abs(column[k, 0] * x + column[k, 1] * y + column[k, 2] * z)
            row = wheels.facet[int(wheels.pairs)]
            row[0], row[1], row[2] = x / distance, y / distance, z / distance
            wheels.pairs += 1.0


@subroutine
def _tabulate_null(wheels: WheelSet, axis: Array, count: int) -> None:
    """Take the null vector whose least part is largest, of the projections of all sign patterns."""
    wheels.null[:] = 0.0
    members = 0
    for k in range(count):
        members += int(wheels.takes_part[k])
    if members <= wheels.rank:
        return
    best = 0.0
    for pattern in range(1 << max(count - 1, 0)):
        least, largest = _null_parts(wheels, axis, count, pattern, False)
        if largest > 0.0 and least / largest > best * (1.0 + 1e-9):
            best = least / largest
            _null_parts(wheels, axis, count, pattern, True)
    largest = 0.0
    for k in range(count):
        largest = max(largest, abs(wheels.null[k]))
    for k in range(count):
        wheels.null[k] = wheels.null[k] / largest if largest > 0.0 else 0.0


@subroutine
def _null_parts(
    wheels: WheelSet, axis: Array, count: int, pattern: int, is_chosen: bool
) -> tuple[float, float]:
    """Project a pattern of signs onto the null space.

    Returns:
        The least part above `LEAST_PART` of the largest (wheels below it cannot be helped), and
        the largest one.
    """
    x, y, z = 0.0, 0.0, 0.0
    for k in range(count):
        sign = wheels.takes_part[k] * (-1.0 if (pattern >> k) & 1 else 1.0)
        x += axis[k, 0] * sign
        y += axis[k, 1] * sign
        z += axis[k, 2] * sign
    largest = 0.0
    for k in range(count):
        part = _part(wheels, pattern, k, x, y, z)
        largest = max(largest, abs(part))
    if largest < 1e-6:
        return 0.0, 0.0
    least = largest
    for k in range(count):
        part = _part(wheels, pattern, k, x, y, z)
        if abs(part) >= LEAST_PART * largest:
            least = min(least, abs(part))
        if is_chosen:
            wheels.null[k] = part
    return least, largest


@subroutine
def _part(wheels: WheelSet, pattern: int, k: int, x: float, y: float, z: float) -> float:
    sign = wheels.takes_part[k] * (-1.0 if (pattern >> k) & 1 else 1.0)
    row = wheels.inverse[k]
    part: float = sign - (row[0] * x + row[1] * y + row[2] * z)
    return part
