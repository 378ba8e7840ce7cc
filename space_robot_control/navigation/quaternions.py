"""Products and small rotations of unit quaternions ``[w, x, y, z]``."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where

Array = NDArray[np.float64]


@kernel
def multiply(left: Array, right: Array, out: Array) -> None:
    """Write the unit quaternion of ``left`` after ``right`` into ``out``, which may be either.

    With ``left`` from the base to the inertial frame, ``right`` turns about the base's axes. The
    product is normalised, so that rounding does not add up over hours.
    """
    a, b, c, d = left[0], left[1], left[2], left[3]
    w, x, y, z = right[0], right[1], right[2], right[3]
    p, q = a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y
    r, s = a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w
    scale = 1.0 / math.sqrt(p * p + q * q + r * r + s * s)
    out[0], out[1], out[2], out[3] = scale * p, scale * q, scale * r, scale * s


@kernel
def turn(rotation: Array, out: Array) -> None:
    """Write the quaternion of a rotation vector (3,), rad, into ``out``, up to its length.

    ``[1, tan(|r|/2) r/|r|]``, the tangent by its series: to 1e-12 of the angle up to 0.1 rad, and
    in plain arithmetic, so that every machine gets the same bits.
    """
    x, y, z = 0.5 * rotation[0], 0.5 * rotation[1], 0.5 * rotation[2]
    square = min(x * x + y * y + z * z, 1.0)
    factor = 1.0 + square * (1.0 / 3.0 + square * (2.0 / 15.0 + square * (17.0 / 315.0)))
    out[0], out[1], out[2], out[3] = 1.0, factor * x, factor * y, factor * z


@kernel
def small_angle(origin: Array, other: Array, out: Array) -> float:
    """Write the rotation from ``origin`` to ``other``, on ``origin``'s axes, into ``out`` (3,).

    Twice the Gibbs vector, rad: the inverse of `turn` to third order, whichever signs the
    quaternions have.

    Returns:
        |cos| of half its angle; below it, where 0, lies half a turn: then ``out`` is useless.
    """
    a, b, c, d = origin[0], origin[1], origin[2], origin[3]
    w, x, y, z = other[0], other[1], other[2], other[3]
    cosine: float = a * w + b * x + c * y + d * z
    factor = where(cosine != 0.0, 2.0 / where(cosine != 0.0, cosine, 1.0), 0.0)
    out[0] = factor * (a * x - b * w - c * z + d * y)
    out[1] = factor * (a * y + b * z - c * w - d * x)
    out[2] = factor * (a * z - b * y + c * x - d * w)
    return abs(cosine)


@kernel
def is_same(one: Array, other: Array) -> bool:
    """Return True if two quaternions are equal up to sign."""
    as_is, negative = True, True
    for k in range(4):
        as_is = as_is & (one[k] == other[k])
        negative = negative & (one[k] == -other[k])
    return as_is | negative
