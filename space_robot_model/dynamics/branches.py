"""Memory of bodies with several branches, for recursions that keep one branch in registers.

Bodies are visited branch by branch (see `Model`). Along a branch the parent is the previous body,
and its values are in registers; at the start of a branch they are read from memory. In the inward
recursion the result of a branch is added to its parent's memory, which the parent reads and clears.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import subroutine

from .algebra import Matrix, Symmetric, Vector, add, add_symmetric, store, symmetric, vector

Array = NDArray[np.float64]
Wrench = tuple[Vector, Vector]
Articulated = tuple[Symmetric, Matrix, Symmetric, Vector, Vector]
"""J, G and M of an articulated inertia, moment and force of its bias force."""


@subroutine
def keep_frame(axes: Matrix, origin: Vector, row: Array) -> None:
    """Write the axes and origin of a body into ``row`` (12,)."""
    for k in range(9):
        row[k] = axes[k]
    store(origin, row, 9)


@subroutine
def kept_frame(row: Array) -> tuple[Matrix, Vector]:
    """Return the axes and origin written by `keep_frame`."""
    axes = (row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])
    return axes, vector(row, 9)


@subroutine
def keep_motion(angular: Vector, linear: Vector, row: Array) -> None:
    """Write a velocity or acceleration of a body into ``row`` (6,)."""
    store(angular, row, 0)
    store(linear, row, 3)


@subroutine
def kept_motion(row: Array) -> Wrench:
    """Return the motion written by `keep_motion`."""
    return vector(row, 0), vector(row, 3)


@subroutine
def accumulate(
    row: Array, inertia: Symmetric, coupling: Matrix, mass: Symmetric, moment: Vector, force: Vector
) -> None:
    """Add the articulated inertia and bias of a branch to its parent's ``row`` (27,)."""
    for k in range(6):
        row[k] += inertia[k]
        row[15 + k] += mass[k]
    for k in range(9):
        row[6 + k] += coupling[k]
    hand_in_wrench(row[21:], moment, force)


@subroutine
def collect_children(
    row: Array, inertia: Symmetric, coupling: Matrix, mass: Symmetric, moment: Vector, force: Vector
) -> Articulated:
    """Return the sum of the arguments and the branches' contributions; clear ``row`` (27,)."""
    inertia = add_symmetric(inertia, symmetric(row))
    mass = add_symmetric(mass, symmetric(row[15:]))
    c = coupling
    coupling = (
        c[0] + row[6],
        c[1] + row[7],
        c[2] + row[8],
        c[3] + row[9],
        c[4] + row[10],
        c[5] + row[11],
        c[6] + row[12],
        c[7] + row[13],
        c[8] + row[14],
    )
    for k in range(21):
        row[k] = 0.0
    moment, force = taken_in_wrench(row[21:], moment, force)
    return inertia, coupling, mass, moment, force


@subroutine
def hand_in_wrench(row: Array, moment: Vector, force: Vector) -> None:
    """Add moment and force of a branch to its parent's ``row`` (6,)."""
    for k in range(3):
        row[k] += moment[k]
        row[3 + k] += force[k]


@subroutine
def taken_in_wrench(row: Array, moment: Vector, force: Vector) -> Wrench:
    """Return the sum of the arguments and the branches' contributions; clear ``row`` (6,)."""
    total = add(moment, vector(row, 0)), add(force, vector(row, 3))
    for k in range(6):
        row[k] = 0.0
    return total
