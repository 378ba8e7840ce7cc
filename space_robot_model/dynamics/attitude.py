"""Unit quaternions ``[w, x, y, z]`` = ``{eta, eps}``, and attitude kinematics (Section II-A).

Two angular velocities are used: ``omega_base`` in the base frame, for which (1) holds, and
``omega_inertial``, for which its skew term has the opposite sign.
"""

from __future__ import annotations

import math

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import where

from ..elementary.matrices import Array
from .algebra import Vector, cross, scale

Quaternion = tuple[float, float, float, float]

SINGULAR_ETA = 1e-6
"""Limit of |eta| below which J0 counts as singular: a rotation by 180 degrees."""


@kernel
def rotation_matrix(quaternion: Array, out: Array) -> None:
    """Write into ``out`` (3, 3) the rotation from the base frame to the inertial frame."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    out[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    out[0, 1] = 2.0 * (x * y - w * z)
    out[0, 2] = 2.0 * (x * z + w * y)
    out[1, 0] = 2.0 * (x * y + w * z)
    out[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    out[1, 2] = 2.0 * (y * z - w * x)
    out[2, 0] = 2.0 * (x * z - w * y)
    out[2, 1] = 2.0 * (y * z + w * x)
    out[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@kernel
def quaternion_rate(quaternion: Array, omega_inertial: Array, out: Array) -> None:
    """Write into ``out`` (4,) the rate of ``quaternion``, 1/s, by ``J0^T`` of (1).

    ``omega_inertial`` (3,) is in inertial axes, rad/s.
    """
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    p, q, r = omega_inertial[0], omega_inertial[1], omega_inertial[2]
    # (2)
    out[0] = -0.5 * (x * p + y * q + z * r)
    # (1) on inertial axes: the skew term has the opposite sign
    out[1] = 0.5 * (w * p + z * q - y * r)
    out[2] = 0.5 * (w * q - z * p + x * r)
    out[3] = 0.5 * (w * r + y * p - x * q)


@kernel
def attitude_jacobian(quaternion: Array, out: Array) -> None:
    """Write into ``out`` (3, 3) ``J0 = (eta E + skew(eps)) / 2`` of (1): epsdot = J0 omega_base."""
    w, x, y, z = 0.5 * quaternion[0], 0.5 * quaternion[1], 0.5 * quaternion[2], 0.5 * quaternion[3]
    out[0, 0], out[0, 1], out[0, 2] = w, -z, y
    out[1, 0], out[1, 1], out[1, 2] = z, w, -x
    out[2, 0], out[2, 1], out[2, 2] = -y, x, w


@kernel
def attitude_jacobian_inverse(quaternion: Array, out: Array) -> None:
    """Write into ``out`` (3, 3) ``J0^-1 = 2 (eta E - skew(eps) + eps eps^T / eta)``.

    Exact for a unit quaternion; the caller must avoid eta = 0 (``SINGULAR_ETA``).
    """
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    out[0, 0] = 2.0 * (w + x * x / w)
    out[0, 1] = 2.0 * (z + x * y / w)
    out[0, 2] = 2.0 * (-y + x * z / w)
    out[1, 0] = 2.0 * (-z + y * x / w)
    out[1, 1] = 2.0 * (w + y * y / w)
    out[1, 2] = 2.0 * (x + y * z / w)
    out[2, 0] = 2.0 * (y + z * x / w)
    out[2, 1] = 2.0 * (-x + z * y / w)
    out[2, 2] = 2.0 * (w + z * z / w)


@kernel
def attitude_error_into(desired: Array, actual: Array, out: Array) -> None:
    """Write ``q_e = q_d* q`` (4,) into ``out``, with the sign nearer to what is there.

    Where there are zeros, eta is not negative.
    """
    eta, ex, ey, ez = relative(four(desired), four(actual))
    near = out[0] * eta + out[1] * ex + out[2] * ey + out[3] * ez
    # nothing to be near to: the shorter of the two turns
    near = where(near == 0.0, eta, near)
    side = where(near < 0.0, -1.0, 1.0)
    out[0], out[1], out[2], out[3] = side * eta, side * ex, side * ey, side * ez


@kernel
def rotate(matrix: Array, vector: Array, out: Array) -> None:
    """Write ``matrix @ vector`` into ``out`` (3,); ``out`` must not be ``vector``."""
    for i in range(3):
        out[i] = matrix[i, 0] * vector[0] + matrix[i, 1] * vector[1] + matrix[i, 2] * vector[2]


@kernel
def rotate_back(matrix: Array, vector: Array, out: Array) -> None:
    """Write ``matrix.T @ vector`` into ``out`` (3,); ``out`` must not be ``vector``."""
    for i in range(3):
        out[i] = matrix[0, i] * vector[0] + matrix[1, i] * vector[1] + matrix[2, i] * vector[2]


@subroutine
def four(row: Array) -> Quaternion:
    """Return the four numbers of ``row``."""
    return row[0], row[1], row[2], row[3]


@subroutine
def relative(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return ``a* b``, the rotation from ``a`` to ``b``."""
    return (
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3],
        a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2],
        a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1],
        a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0],
    )


@subroutine
def columns_quaternion(a: Vector, b: Vector, c: Vector) -> Quaternion:
    """Return the unit quaternion of the rotation with these columns (Shepperd 1978)."""
    trace = a[0] + b[1] + c[2]
    # from the largest component, so that nothing is divided by a small number
    if trace >= max(a[0], b[1], c[2]):
        q = (1.0 + trace, b[2] - c[1], c[0] - a[2], a[1] - b[0])
    elif a[0] >= max(b[1], c[2]):
        q = (b[2] - c[1], 1.0 + 2.0 * a[0] - trace, b[0] + a[1], c[0] + a[2])
    elif b[1] >= c[2]:
        q = (c[0] - a[2], b[0] + a[1], 1.0 + 2.0 * b[1] - trace, c[1] + b[2])
    else:
        q = (a[1] - b[0], c[0] + a[2], c[1] + b[2], 1.0 + 2.0 * c[2] - trace)
    size = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return q[0] * size, q[1] * size, q[2] * size, q[3] * size


@subroutine
def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the product of two quaternions."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
        a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
    )


@subroutine
def rotated(q: Quaternion, a: Vector) -> Vector:
    """Return ``a`` rotated by a unit quaternion."""
    x, y, z, w = q[1], q[2], q[3], q[0]
    t = scale(cross((x, y, z), a), 2.0)
    s = cross((x, y, z), t)
    return a[0] + w * t[0] + s[0], a[1] + w * t[1] + s[1], a[2] + w * t[2] + s[2]


@kernel
def compose(left: Array, right: Array, out: Array) -> None:
    """Write the unit quaternion of ``left`` after ``right`` into ``out``, which may be either.

    With ``left`` from the base to the inertial frame, ``right`` turns about the base's axes. The
    product is normalised, so that rounding does not add up over hours. Its terms are not in the
    order of `multiply`: recorded flights have the bits of either.
    """
    a, b, c, d = left[0], left[1], left[2], left[3]
    w, x, y, z = right[0], right[1], right[2], right[3]
    p, q = a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y
    r, s = a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w
    scale = 1.0 / math.sqrt(p * p + q * q + r * r + s * s)
    out[0], out[1], out[2], out[3] = scale * p, scale * q, scale * r, scale * s


@kernel
def from_small_rotation(rotation: Array, out: Array) -> None:
    """Write the quaternion of a rotation vector (3,), rad, into ``out``, up to its length.

    ``[1, tan(|r|/2) r/|r|]``, the tangent by its series: to 1e-12 of the angle up to 0.1 rad, and
    in plain arithmetic, so that every machine gets the same bits.
    """
    x, y, z = 0.5 * rotation[0], 0.5 * rotation[1], 0.5 * rotation[2]
    square = min(x * x + y * y + z * z, 1.0)
    factor = 1.0 + square * (1.0 / 3.0 + square * (2.0 / 15.0 + square * (17.0 / 315.0)))
    out[0], out[1], out[2], out[3] = 1.0, factor * x, factor * y, factor * z


@kernel
def to_small_rotation(origin: Array, other: Array, out: Array) -> float:
    """Write the rotation from ``origin`` to ``other``, on ``origin``'s axes, into ``out`` (3,).

    Twice the Gibbs vector, rad: the inverse of `from_small_rotation` to third order, whichever
    signs the quaternions have.

    Returns:
        |cos| of half its angle; below it, where 0, lies half a turn: then ``out`` is useless.
    """
    cosine, x, y, z = relative(four(origin), four(other))
    factor = where(cosine != 0.0, 2.0 / where(cosine != 0.0, cosine, 1.0), 0.0)
    out[0], out[1], out[2] = factor * x, factor * y, factor * z
    return abs(cosine)


@kernel
def is_same_attitude(one: Array, other: Array) -> bool:
    """Return True if two quaternions are equal up to sign."""
    as_is, negative = True, True
    for k in range(4):
        as_is = as_is & (one[k] == other[k])
        negative = negative & (one[k] == -other[k])
    return as_is | negative
