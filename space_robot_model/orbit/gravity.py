"""The Earth's gravity at a place; J2 is its oblateness, about z."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform

from ..dynamics.algebra import Vector, add, dot, scale, store, subtract, vector
from .elements import MU, OBLATENESS

Array = NDArray[np.float64]


@kernel
def gravity(position: Array, has_j2: float, out: Array) -> None:
    """Write the acceleration of free fall at ``position`` (3,) into ``out`` (3,), m/s2."""
    store(gravity_at(vector(position, 0), has_j2), out, 0)


@subroutine
def gravity_at(r: Vector, has_j2: float) -> Vector:
    """Return the acceleration of free fall at ``r``, m/s2."""
    square = dot(r, r)
    distance = np.sqrt(square)
    fall = scale(r, -MU / (square * distance))
    if uniform(has_j2) != 0.0:
        factor = -OBLATENESS / (square * square * distance)
        height = 5.0 * r[2] * r[2] / square
        pull = (r[0] * (1.0 - height), r[1] * (1.0 - height), r[2] * (3.0 - height))
        fall = add(fall, scale(pull, factor))
    return fall


@subroutine
def gravity_rate(r: Vector, v: Vector, has_j2: float) -> Vector:
    """Return the rate of change of `gravity_at` for a point that moves with ``v``, m/s3."""
    square = dot(r, r)
    distance, approach = np.sqrt(square), dot(r, v) / square
    rate = scale(subtract(v, scale(r, 3.0 * approach)), -MU / (square * distance))
    if uniform(has_j2) != 0.0:
        factor = -OBLATENESS / (square * square * distance)
        height = 5.0 * r[2] * r[2] / square
        lift = 10.0 * r[2] * v[2] / square - 2.0 * height * approach
        # of the pull, whose factor falls with the fifth power of the distance
        across, up = 1.0 - height, 3.0 - height
        fading, polar = lift + 5.0 * approach * across, lift + 5.0 * approach * up
        pull = (
            v[0] * across - r[0] * fading,
            v[1] * across - r[1] * fading,
            v[2] * up - r[2] * polar,
        )
        rate = add(rate, scale(pull, factor))
    return rate
