"""Algebra of three-vectors and 3 x 3 matrices as tuples, and their memory.

Tuples are kept in registers, since the compiler need not consider overlaps as for array views.
A symmetric matrix is ``(xx, yy, zz, xy, xz, yz)``, a general one nine numbers row by row.

Recursions visit bodies branch by branch (see `Model`). Along a branch the parent is the previous
body, and its values are in registers; at the start of a branch they are loaded from its row. In
the inward recursion the result of a branch is added to its parent's row, which the parent collects
and clears.
"""

from __future__ import annotations

from space_robot_msgs_py.compiled.kernels import subroutine

from ..elementary.matrices import Array

Vector = tuple[float, float, float]
Symmetric = tuple[float, float, float, float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]
Spatial = tuple[Vector, Vector]
"""Angular and linear part of a velocity, acceleration or force."""


@subroutine
def vector(row: Array, start: int) -> Vector:
    """Return three numbers of ``row`` from ``start`` on."""
    return row[start], row[start + 1], row[start + 2]


@subroutine
def store(a: Vector, row: Array, start: int) -> None:
    """Write ``a`` into ``row`` from ``start`` on."""
    row[start], row[start + 1], row[start + 2] = a


@subroutine
def add(a: Vector, b: Vector) -> Vector:
    """Return ``a + b``."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@subroutine
def subtract(a: Vector, b: Vector) -> Vector:
    """Return ``a - b``."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@subroutine
def scale(a: Vector, factor: float) -> Vector:
    """Return ``a * factor``."""
    return a[0] * factor, a[1] * factor, a[2] * factor


@subroutine
def dot(a: Vector, b: Vector) -> float:
    """Return ``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@subroutine
def cross(a: Vector, b: Vector) -> Vector:
    """Return ``a x b``."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@subroutine
def combine(x: Vector, y: Vector, z: Vector, a: float, b: float, c: float) -> Vector:
    """Return ``a x + b y + c z``."""
    return add(add(scale(x, a), scale(y, b)), scale(z, c))


@subroutine
def rotate_axes(x: Vector, y: Vector, z: Vector, rotation: Array) -> tuple[Vector, Vector, Vector]:
    """Return the axes of a frame with a ``rotation`` (9,), row by row, relative to x, y, z."""
    e = rotation
    first, second = combine(x, y, z, e[0], e[3], e[6]), combine(x, y, z, e[1], e[4], e[7])
    return first, second, combine(x, y, z, e[2], e[5], e[8])


@subroutine
def symmetric(row: Array) -> Symmetric:
    """Return the six numbers of ``row``."""
    return row[0], row[1], row[2], row[3], row[4], row[5]


@subroutine
def add_symmetric(a: Symmetric, b: Symmetric) -> Symmetric:
    """Return ``a + b``."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@subroutine
def outer_subtracted(s: Symmetric, a: Vector, b: Vector) -> Symmetric:
    """Return ``s - a b^T`` for parallel ``a`` and ``b``."""
    return (
        s[0] - a[0] * b[0],
        s[1] - a[1] * b[1],
        s[2] - a[2] * b[2],
        s[3] - a[0] * b[1],
        s[4] - a[0] * b[2],
        s[5] - a[1] * b[2],
    )


@subroutine
def transform_symmetric(s: Symmetric, a: Vector) -> Vector:
    """Return ``s a``."""
    return (
        s[0] * a[0] + s[3] * a[1] + s[4] * a[2],
        s[3] * a[0] + s[1] * a[1] + s[5] * a[2],
        s[4] * a[0] + s[5] * a[1] + s[2] * a[2],
    )


@subroutine
def transform(m: Matrix, a: Vector) -> Vector:
    """Return ``m a``."""
    return (
        m[0] * a[0] + m[1] * a[1] + m[2] * a[2],
        m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
        m[6] * a[0] + m[7] * a[1] + m[8] * a[2],
    )


@subroutine
def transform_transposed(m: Matrix, a: Vector) -> Vector:
    """Return ``m^T a``."""
    return (
        m[0] * a[0] + m[3] * a[1] + m[6] * a[2],
        m[1] * a[0] + m[4] * a[1] + m[7] * a[2],
        m[2] * a[0] + m[5] * a[1] + m[8] * a[2],
    )


@subroutine
def skew_added(m: Matrix, a: Vector) -> Matrix:
    """Return ``m + skew(a)``, ``skew(a) b = a x b``."""
    return (
        m[0],
        m[1] - a[2],
        m[2] + a[1],
        m[3] + a[2],
        m[4],
        m[5] - a[0],
        m[6] - a[1],
        m[7] + a[0],
        m[8],
    )


@subroutine
def outer_subtracted_general(m: Matrix, a: Vector, b: Vector) -> Matrix:
    """Return ``m - a b^T``."""
    return (
        m[0] - a[0] * b[0],
        m[1] - a[0] * b[1],
        m[2] - a[0] * b[2],
        m[3] - a[1] * b[0],
        m[4] - a[1] * b[1],
        m[5] - a[1] * b[2],
        m[6] - a[2] * b[0],
        m[7] - a[2] * b[1],
        m[8] - a[2] * b[2],
    )


@subroutine
def inverse_symmetric(s: Symmetric) -> Symmetric:
    """Return ``s^-1`` of a positive definite matrix, by cofactors."""
    xx = s[1] * s[2] - s[5] * s[5]
    xy = s[4] * s[5] - s[3] * s[2]
    xz = s[3] * s[5] - s[4] * s[1]
    factor = 1.0 / (s[0] * xx + s[3] * xy + s[4] * xz)
    return (
        xx * factor,
        (s[0] * s[2] - s[4] * s[4]) * factor,
        (s[0] * s[1] - s[3] * s[3]) * factor,
        xy * factor,
        xz * factor,
        (s[3] * s[4] - s[0] * s[5]) * factor,
    )


@subroutine
def store_frame(axes: Matrix, origin: Vector, row: Array) -> None:
    """Write the axes and origin of a body into ``row`` (12,)."""
    for k in range(9):
        row[k] = axes[k]
    store(origin, row, 9)


@subroutine
def load_frame(row: Array) -> tuple[Matrix, Vector]:
    """Return the axes and origin written by `store_frame`."""
    axes = (row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])
    return axes, vector(row, 9)


@subroutine
def store_motion(angular: Vector, linear: Vector, row: Array) -> None:
    """Write a velocity or acceleration of a body into ``row`` (6,)."""
    store(angular, row, 0)
    store(linear, row, 3)


@subroutine
def load_motion(row: Array) -> Spatial:
    """Return the motion written by `store_motion`."""
    return vector(row, 0), vector(row, 3)


@subroutine
def accumulate_wrench(row: Array, moment: Vector, force: Vector) -> None:
    """Add moment and force of a branch to its parent's ``row`` (6,)."""
    for k in range(3):
        row[k] += moment[k]
        row[3 + k] += force[k]


@subroutine
def collect_wrench(row: Array, moment: Vector, force: Vector) -> Spatial:
    """Return the sum of the arguments and the branches' contributions; clear ``row`` (6,)."""
    total = add(moment, vector(row, 0)), add(force, vector(row, 3))
    for k in range(6):
        row[k] = 0.0
    return total
