"""Torque distribution among wheels that minimises the largest load.

Markley, Reynolds, Liu & Lebsock, "Maximum Torque and Momentum Envelopes for Reaction-Wheel Arrays",
J. Guidance 33(5), 2010. The torques within reach of loads up to d fill a polyhedron that grows with
d. Each pair of wheels spans one of its facets; at the facet that a torque lies on, all other wheels
have the load d, with the sign of their axis' component along its normal, and the pair takes the
rest. Where more than two axes lie in a facet, the same holds in its plane, and on its line.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine

from .wheel_set import LEAST_SINE, WheelSet

Array = NDArray[np.float64]


@kernel
def least_largest(wheels: WheelSet, count: int, wanted: Array, torque: Array) -> None:
    """Write ``torque`` (>= count,) of the motors with ``A torque = wanted`` (3,), N m.

    The largest share of a full load is least. The set must have three independent axes.
    """
    largest, best, side = 0.0, 0, 1.0
    for row in range(int(wheels.pairs)):
        facet = wheels.facet[row]
        along = facet[0] * wanted[0] + facet[1] * wanted[1] + facet[2] * wanted[2]
        if abs(along) > largest:
            largest, best, side = abs(along), row, (1.0 if along > 0.0 else -1.0)
    normal, column = wheels.facet[best], wheels.column
    x, y, z = wanted[0], wanted[1], wanted[2]
    size = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    for k in range(count):
        torque[k] = 0.0
        part = normal[0] * column[k, 0] + normal[1] * column[k, 1] + normal[2] * column[k, 2]
        if not _is_along(part, size * wheels.full_load[k]) or wheels.takes_part[k] == 0.0:
            continue
        load = largest * side if part > 0.0 else -largest * side
        torque[k] = load * wheels.full_load[k]
        x -= load * column[k, 0]
        y -= load * column[k, 1]
        z -= load * column[k, 2]
    _share_in_plane(wheels, count, normal, size, x, y, z, torque)
    for _ in range(2):  # what rounding, and axes that are nearly in the plane, have left
        _correct(wheels, count, wanted, torque)


@subroutine
def _is_along(part: float, whole: float) -> bool:
    """Return True if a component along a direction exceeds rounding errors."""
    return abs(part) > LEAST_SINE * whole


@subroutine
def _share_in_plane(
    wheels: WheelSet,
    count: int,
    normal: Array,
    size: float,
    x: float,
    y: float,
    z: float,
    torque: Array,
) -> None:
    """Distribute (x, y, z) N m, in the plane of a facet, to the wheels with axes in it."""
    column, full_load = wheels.column, wheels.full_load
    largest, best, side = 0.0, -1, 1.0
    best_x, best_y, best_z = 0.0, 0.0, 0.0
    for k in range(count):
        if not _is_in_plane(wheels, k, normal, size):
            continue
        # across the wheel's axis, in the plane
        a = (normal[1] * column[k, 2] - normal[2] * column[k, 1]) / size
        b = (normal[2] * column[k, 0] - normal[0] * column[k, 2]) / size
        c = (normal[0] * column[k, 1] - normal[1] * column[k, 0]) / size
        reach = 0.0
        for j in range(count):
            if _is_in_plane(wheels, j, normal, size):
                reach += abs(a * column[j, 0] + b * column[j, 1] + c * column[j, 2])
        along = (a * x + b * y + c * z) / reach
        if best < 0 or abs(along) > largest:
            largest, best, side = abs(along), k, (1.0 if along > 0.0 else -1.0)
            best_x, best_y, best_z = a, b, c
    for k in range(count):
        if not _is_in_plane(wheels, k, normal, size):
            continue
        part = best_x * column[k, 0] + best_y * column[k, 1] + best_z * column[k, 2]
        if _is_along(part, full_load[best] * full_load[k]):
            load = largest * side if part > 0.0 else -largest * side
            torque[k] = load * full_load[k]
            x -= load * column[k, 0]
            y -= load * column[k, 1]
            z -= load * column[k, 2]
    # the wheels whose axes are parallel to the best one's share the rest equally
    along = (x * column[best, 0] + y * column[best, 1] + z * column[best, 2]) / full_load[best]
    reach = 0.0
    for k in range(count):
        if _is_in_plane(wheels, k, normal, size):
            part = best_x * column[k, 0] + best_y * column[k, 1] + best_z * column[k, 2]
            if not _is_along(part, full_load[best] * full_load[k]):
                reach += full_load[k]
    for k in range(count):
        if _is_in_plane(wheels, k, normal, size):
            part = best_x * column[k, 0] + best_y * column[k, 1] + best_z * column[k, 2]
            if not _is_along(part, full_load[best] * full_load[k]):
                dot = column[k, 0] * column[best, 0] + column[k, 1] * column[best, 1]
                dot += column[k, 2] * column[best, 2]
                torque[k] = (along if dot > 0.0 else -along) / reach * full_load[k]


@subroutine
def _is_in_plane(wheels: WheelSet, k: int, normal: Array, size: float) -> bool:
    """Return True if a wheel of the set has its axis perpendicular to ``normal``."""
    if wheels.takes_part[k] == 0.0:
        return False
    column = wheels.column[k]
    part = normal[0] * column[0] + normal[1] * column[1] + normal[2] * column[2]
    return not _is_along(part, size * wheels.full_load[k])


@subroutine
def _correct(wheels: WheelSet, count: int, wanted: Array, torque: Array) -> None:
    """Correct ``A torque`` to the wanted torque by least squares."""
    x, y, z = wanted[0], wanted[1], wanted[2]
    for k in range(count):
        if wheels.takes_part[k] == 1.0:
            load = torque[k] / wheels.full_load[k]
            x -= load * wheels.column[k, 0]
            y -= load * wheels.column[k, 1]
            z -= load * wheels.column[k, 2]
    for k in range(count):
        row = wheels.inverse[k]
        torque[k] += row[0] * x + row[1] * y + row[2] * z
