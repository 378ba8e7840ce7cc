"""The pose of the end effector, for every tick of a flight at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .base_axes import base_axes
from .robot import Robot

Array = NDArray[np.float64]

_BATCH = 8192
"""Rows at a time, so that all vectors of a batch stay in the processor's cache."""


def tool_pose(robot: Robot, quaternion: Array, joint_positions: Array) -> tuple[Array, Array]:
    """Return axes and position of the end effector's frame, the base's CoM as origin.

    ``T(i-1 -> i) = Rx(alpha_{i-1}) Tx(a_{i-1}) Rz(theta_i) Tz(d_i)`` (modified Denavit-Hartenberg),
    then the tool's, whose theta is 0.

    Args:
        robot: the robot's numbers; masses do not matter.
        quaternion: (N, 4) ``[w, x, y, z]`` of the base, unit.
        joint_positions: (N, n) rad.

    Returns:
        (N, 3, 3) rotation from the tool's frame to the inertial one, its columns the tool's
        axes; (N, 3) m, on inertial axes.

    Raises:
        ValueError: an argument has the wrong shape.
    """
    rows = len(quaternion)
    if quaternion.shape != (rows, 4) or joint_positions.shape != (rows, robot.n):
        raise ValueError(
            f"shapes (N, 4) and (N, {robot.n}) were expected, "
            f"got {quaternion.shape} and {joint_positions.shape}"
        )
    rotation, position = np.empty((rows, 3, 3)), np.empty((rows, 3))
    for start in range(0, rows, _BATCH):
        part = slice(start, start + _BATCH)
        x, y, z, at = _chain(robot, quaternion[part].T, joint_positions[part].T)
        rotation[part, :, 0], rotation[part, :, 1], rotation[part, :, 2] = x.T, y.T, z.T
        position[part] = at.T
    return rotation, position


def _chain(robot: Robot, quaternion: Array, theta: Array) -> tuple[Array, Array, Array, Array]:
    """Return the tool's axes and position (m), (3, N) each, from (4, N) and (n, N) rad."""
    axis_x, axis_y, axis_z = base_axes(quaternion)
    at = np.zeros_like(axis_x)
    model = robot.model
    for i in range(robot.n):
        ca, sa, ct, st = model.cos_alpha[i], model.sin_alpha[i], np.cos(theta[i]), np.sin(theta[i])
        at += model.a[i] * axis_x
        axis_y, axis_z = ca * axis_y + sa * axis_z, ca * axis_z - sa * axis_y
        at += model.d[i] * axis_z
        axis_x, axis_y = ct * axis_x + st * axis_y, ct * axis_y - st * axis_x
    alpha, a, d = robot.tool
    ca, sa = np.cos(alpha), np.sin(alpha)
    at += a * axis_x
    axis_y, axis_z = ca * axis_y + sa * axis_z, ca * axis_z - sa * axis_y
    at += d * axis_z
    return axis_x, axis_y, axis_z, at
