"""Pose of the end effector, for all ticks of a flight at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .base_axes import base_axes
from .frames import body_frames
from .robot import Robot

Array = NDArray[np.float64]

_BATCH = 8192
"""Rows per batch, so that all vectors of a batch fit into the processor's cache."""


def tool_pose(robot: Robot, quaternion: Array, joint_positions: Array) -> tuple[Array, Array]:
    """Return rotation and position of the end effector's frame, relative to the base's.

    Args:
        robot: its masses are not used.
        quaternion: (N, 4) unit quaternion ``[w, x, y, z]`` of the base.
        joint_positions: (N, J) of all joints, passive ones last; rad, or m for prismatic ones.

    Returns:
        (N, 3, 3) rotation from the tool's frame to the inertial one; (N, 3) position, m, inertial
        axes.

    Raises:
        ValueError: an argument has a wrong shape.
    """
    rows = len(quaternion)
    if quaternion.shape != (rows, 4) or joint_positions.shape != (rows, robot.joint_count):
        raise ValueError(
            f"shapes (N, 4) and (N, {robot.joint_count}) were expected, "
            f"got {quaternion.shape} and {joint_positions.shape}"
        )
    rotation, position = np.empty((rows, 3, 3)), np.empty((rows, 3))
    for start in range(0, rows, _BATCH):
        part = slice(start, start + _BATCH)
        axes, at = _tool(robot, quaternion[part].T, joint_positions[part].T)
        rotation[part], position[part] = axes.transpose(2, 1, 0), at.T
    return rotation, position


def _tool(robot: Robot, quaternion: Array, positions: Array) -> tuple[Array, Array]:
    """Return the tool's axes (3, 3, T), as rows, and position (3, T), m, from (4, T), (N, T)."""
    tool = robot.tool
    x, y, z = base_axes(quaternion)
    frames = body_frames(robot, (x, y, z), positions)
    carrier = next(frame for frame in frames if frame.body == tool.body)
    axes = np.array([carrier.on_outer_axes(tool.rotation[:, k]) for k in range(3)])
    return axes, carrier.origin + carrier.on_outer_axes(tool.position)
