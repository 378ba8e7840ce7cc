"""Frames of a robot's bodies, for all ticks of a flight at once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..elementary.functions import sines_cosines
from .robot import Robot

Array = NDArray[np.float64]


class BodyFrame(NamedTuple):
    """Frame of a body at T ticks; vectors (3, T) in the axes of an outer frame."""

    body: int
    x: Array
    y: Array
    z: Array
    """Axis of the joint that moves the body."""
    origin: Array
    """Position relative to the base's CoM, m."""

    def on_outer_axes(self, vector: Array) -> Array:
        """Rotate a vector (3,) from the body's axes to the outer frame's, (3, T)."""
        turned: Array = self.x * vector[0] + self.y * vector[1] + self.z * vector[2]
        return turned


def body_frames(
    robot: Robot, base_axes: tuple[Array, Array, Array], joint_positions: Array
) -> Iterator[BodyFrame]:
    """Yield the frame of the base, then of every body, parents before children.

    Args:
        robot: its masses are not used.
        base_axes: x, y and z axis of the base, (3, T) each.
        joint_positions: (N, T) of all joints, rad, or m for prismatic ones.
    """
    frames = {0: BodyFrame(0, *base_axes, np.zeros_like(base_axes[0]))}
    yield frames[0]
    for joint in robot.order:
        _, x, y, z, origin = frames[int(robot.parent[joint])]
        turn, offset, position = robot.rotation[joint], robot.offset[joint], joint_positions[joint]
        x, y, z = (_combined((x, y, z), turn[:, k]) for k in range(3))
        origin = origin + _combined((x, y, z), offset)
        if robot.is_prismatic[joint]:
            origin = origin + position * z
        else:
            st, ct = sines_cosines(position)
            x, y = ct * x + st * y, ct * y - st * x
        frames[joint + 1] = BodyFrame(joint + 1, x, y, z, origin)
        yield frames[joint + 1]


def _combined(vectors: tuple[Array, Array, Array], factors: Array) -> Array:
    """Return the linear combination of the vectors, skipping the factors that are zero."""
    terms = [
        factor * vector for factor, vector in zip(factors, vectors, strict=True) if factor != 0.0
    ]
    total = terms[0] if terms else np.zeros_like(vectors[0])
    for term in terms[1:]:
        total = total + term
    return total
