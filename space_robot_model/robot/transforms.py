"""The robot as a tree of transforms as in tf: each body relative to its parent, at each tick."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..elementary.matrices import norm
from .names import frame_names
from .robot import Robot

Array = NDArray[np.float64]


class Transform(NamedTuple):
    """Pose of a body's frame relative to its parent's, at T ticks."""

    parent: str
    child: str
    position: Array
    """(T, 3) position, m, or (1, 3) if constant."""
    quaternion: Array
    """(T, 4) ``[w, x, y, z]`` from child to parent axes, or (1, 4) if constant."""


def joint_transforms(robot: Robot, joint_positions: Array) -> list[Transform]:
    """Return the transform of every joint, parents before children.

    Args:
        robot: with frames named by `frame_names`.
        joint_positions: (T, N) of all joints, passive ones last; rad, or m for prismatic ones.
    """
    transforms, names = [], frame_names(robot).bodies
    for joint in robot.order:
        turn, offset = robot.rotation[joint], robot.offset[joint]
        at_zero, moved = wxyz(turn)[np.newaxis], joint_positions[:, joint]
        if robot.is_prismatic[joint]:
            along = offset + np.outer(moved, (0.0, 0.0, 1.0))
            position, quaternion = along @ turn.T, at_zero
        else:
            # q0 (cos theta/2, 0, 0, sin theta/2)
            c, s = np.cos(0.5 * moved), np.sin(0.5 * moved)
            w, x, y, z = at_zero[0]
            quaternion = np.column_stack(
                [w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s]
            )
            position = (turn @ offset)[np.newaxis]
        transforms.append(
            Transform(names[robot.parent[joint]], names[joint + 1], position, quaternion)
        )
    return transforms


def tool_transforms(robot: Robot) -> list[Transform]:
    """Return the fixed transforms of the tools."""
    names = frame_names(robot)
    return [
        Transform(
            names.bodies[tool.body],
            name,
            tool.position[np.newaxis],
            wxyz(tool.rotation)[np.newaxis],
        )
        for tool, name in zip(robot.tools, names.tools, strict=True)
    ]


def wxyz(rotation: Array) -> Array:
    """Return the unit quaternion ``[w, x, y, z]`` of a rotation matrix (3, 3).

    Importing SciPy's function would delay the plant by 0.25 s.
    """
    (a, b, c), (d, e, f), (g, h, i) = rotation
    products = np.array(  # 4 q q^T; the row with the largest square is the most accurate
        [
            [1.0 + a + e + i, h - f, c - g, d - b],
            [h - f, 1.0 + a - e - i, b + d, c + g],
            [c - g, b + d, 1.0 - a + e - i, f + h],
            [d - b, c + g, f + h, 1.0 - a - e + i],
        ]
    )
    row: Array = products[np.argmax(np.diag(products))]
    return row / norm(row)
