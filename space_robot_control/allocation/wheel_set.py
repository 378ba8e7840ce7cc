"""Wheels that share a torque: tables of their axes, and the sharing with the least largest load.

Motor torques u (W,) on wheels with unit axes a_k turn the base with ``-sum a_k u_k = -A u``. Which
u gives a torque is not unique with more than three wheels: ``u = A^+ torque`` has the least sum of
squared loads, `least_largest` the least largest load (Markley, Reynolds, Liu & Lebsock, "Maximum
Torque and Momentum Envelopes for Reaction-Wheel Arrays", J. Guidance 33(5), 2010).

The torques within reach of loads up to d fill a polyhedron that grows with d. Each pair of wheels
spans one of its facets; at the facet that a torque lies on, all other wheels have the load d, with
the sign of their axis' component along its normal, and the pair takes the rest. Where more than two
axes lie in a facet, the same holds in its plane, and on its line.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import (
    Vector,
    add,
    cross,
    dot,
    scale,
    store,
    subtract,
    vector,
)
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


class WheelSet(Record):
    """A subset of the wheels, with its tables, computed anew when a wheel is excluded."""

    takes_part: Array = shaped(lambda n: (MOST_WHEELS,), "1 for each wheel in the set, else 0")
    column: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Axis times full load, N m; 0 for a wheel that takes no part."""
    full_load: Array = shaped(lambda n: (MOST_WHEELS,))
    """Torque in which the load of each wheel is measured, N m."""
    rank: float = shaped(lambda n: (), "Number of independent axes")
    inverse: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """``A^+`` of least ``sum (u_k / full load)^2``; 1."""
    beyond: Array = shaped(lambda n: (3, 3), "Projector onto the torques that the set cannot give")
    pairs: float = shaped(lambda n: (), "Number of rows in use of the following tables")
    facet: Array = shaped(lambda n: (MOST_PAIRS, 3))
    """Normal of each facet of the largest torques, over its distance from the origin, 1/(N m)."""
    null: Array = shaped(lambda n: (MOST_WHEELS,))
    """Momenta that cancel one another, the largest part 1; 0 where there is none."""
    matrix: Array = shaped(lambda n: (3, 3, 3), "Scratch")


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
    # A A^T of the weighed axes, of which the pseudo-inverse is A^T (A A^T)^+
    diagonalise(matrix, vectors)
    largest = max(matrix[0, 0], matrix[1, 1], matrix[2, 2])
    inverse[:] = 0.0
    wheels.beyond[:] = 0.0
    wheels.rank = 0.0
    for k in range(3):
        is_turned = largest > 0.0 and matrix[k, k] > LEAST_EIGENVALUE * largest
        wheels.rank += 1.0 if is_turned else 0.0
        for i in range(3):
            for j in range(3):
                product = vectors[i, k] * vectors[j, k]
                if is_turned:
                    inverse[i, j] += product / matrix[k, k]
                else:
                    wheels.beyond[i, j] += product
    for k in range(MOST_WHEELS):
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += wheels.column[k, j] * inverse[j, i]
            wheels.inverse[k, i] = total * wheels.full_load[k]
    _tabulate_facets(wheels, count)
    _tabulate_null(wheels, axis, count)


@subroutine
def _tabulate_facets(wheels: WheelSet, count: int) -> None:
    wheels.pairs = 0.0
    if wheels.rank < 3.0:
        return
    column = wheels.column
    for i in range(count):
        for j in range(i + 1, count):
            normal = cross(vector(column[i], 0), vector(column[j], 0))
            least = LEAST_SINE * (wheels.full_load[i] * wheels.full_load[j])
            if not dot(normal, normal) > least * least:  # parallel, or one of them is out
                continue
            distance = 0.0
            for k in range(count):
                distance += abs(dot(vector(column[k], 0), normal))
            # at the facet's distance every wheel has its full load, in the sense of the normal
            facet = (normal[0] / distance, normal[1] / distance, normal[2] / distance)
            store(facet, wheels.facet[int(wheels.pairs)], 0)
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
    # half of the patterns: the others are their negatives
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
    total = (0.0, 0.0, 0.0)
    for k in range(count):
        total = add(total, scale(vector(axis[k], 0), _sign(wheels, pattern, k)))
    largest = 0.0
    for k in range(count):
        part = _sign(wheels, pattern, k) - dot(vector(wheels.inverse[k], 0), total)
        largest = max(largest, abs(part))
    if largest < 1e-6:
        return 0.0, 0.0
    least = largest
    for k in range(count):
        part = _sign(wheels, pattern, k) - dot(vector(wheels.inverse[k], 0), total)
        if abs(part) >= LEAST_PART * largest:
            least = min(least, abs(part))
        if is_chosen:
            wheels.null[k] = part
    return least, largest


@subroutine
def _sign(wheels: WheelSet, pattern: int, k: int) -> float:
    sign: float = wheels.takes_part[k] * (-1.0 if (pattern >> k) & 1 else 1.0)
    return sign


@kernel
def least_largest(wheels: WheelSet, count: int, wanted: Vector, torque: Array) -> None:
    """Write ``torque`` (>= count,) of the motors with ``A torque = wanted``, N m.

    The largest share of a full load is least. The set must have three independent axes.
    """
    largest, best, side = 0.0, 0, 1.0
    for row in range(int(wheels.pairs)):
        along = dot(vector(wheels.facet[row], 0), wanted)
        if abs(along) > largest:
            largest, best, side = abs(along), row, (1.0 if along > 0.0 else -1.0)
    normal, left = vector(wheels.facet[best], 0), wanted
    size = np.sqrt(dot(normal, normal))
    for k in range(count):
        torque[k] = 0.0
        column = vector(wheels.column[k], 0)
        part = dot(normal, column)
        if not _is_along(part, size * wheels.full_load[k]) or wheels.takes_part[k] == 0.0:
            continue
        load = largest * side if part > 0.0 else -largest * side
        torque[k] = load * wheels.full_load[k]
        left = subtract(left, scale(column, load))
    _share_in_plane(wheels, count, normal, size, left, torque)
    for _ in range(2):  # what rounding, and axes that are nearly in the plane, have left
        left = wanted
        for k in range(count):
            if wheels.takes_part[k] == 1.0:
                load = torque[k] / wheels.full_load[k]
                left = subtract(left, scale(vector(wheels.column[k], 0), load))
        for k in range(count):
            torque[k] += dot(vector(wheels.inverse[k], 0), left)


@subroutine
def _is_along(part: float, whole: float) -> bool:
    """Return True if a component along a direction exceeds rounding errors."""
    return abs(part) > LEAST_SINE * whole


@subroutine
def _is_in_plane(wheels: WheelSet, k: int, normal: Vector, size: float) -> bool:
    if wheels.takes_part[k] == 0.0:
        return False
    part = dot(normal, vector(wheels.column[k], 0))
    return not _is_along(part, size * wheels.full_load[k])


@subroutine
def _share_in_plane(
    wheels: WheelSet, count: int, normal: Vector, size: float, left: Vector, torque: Array
) -> None:
    """Distribute what is ``left``, in the plane of a facet, to the wheels with axes in it."""
    column, full_load = wheels.column, wheels.full_load
    largest, best, side, across_best = 0.0, -1, 1.0, (0.0, 0.0, 0.0)
    for k in range(count):
        if not _is_in_plane(wheels, k, normal, size):
            continue
        turned = cross(normal, vector(column[k], 0))
        across = (turned[0] / size, turned[1] / size, turned[2] / size)
        reach = 0.0
        for j in range(count):
            if _is_in_plane(wheels, j, normal, size):
                reach += abs(dot(across, vector(column[j], 0)))
        along = dot(across, left) / reach
        if best < 0 or abs(along) > largest:
            largest, best, side = abs(along), k, (1.0 if along > 0.0 else -1.0)
            across_best = across
    parallel_load = 0.0  # of the wheels with the best one's axis, which share the rest equally
    for k in range(count):
        if not _is_in_plane(wheels, k, normal, size):
            continue
        part = dot(across_best, vector(column[k], 0))
        if _is_along(part, full_load[best] * full_load[k]):
            load = largest * side if part > 0.0 else -largest * side
            torque[k] = load * full_load[k]
            left = subtract(left, scale(vector(column[k], 0), load))
        else:
            parallel_load += full_load[k]
    along = dot(left, vector(column[best], 0)) / full_load[best]
    for k in range(count):
        if _is_in_plane(wheels, k, normal, size):
            part = dot(across_best, vector(column[k], 0))
            if not _is_along(part, full_load[best] * full_load[k]):
                is_same_side = dot(vector(column[k], 0), vector(column[best], 0)) > 0.0
                torque[k] = (along if is_same_side else -along) / parallel_load * full_load[k]
