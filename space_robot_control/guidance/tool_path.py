"""Paths of a tool: a straight line and the shortest turn, and the joints that follow them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.inverse_kinematics import (
    FreeBase,
    follow_free_path_into,
    follow_path_into,
)
from space_robot_model.dynamics.tool_kinematics import ToolKinematics, tool_kinematics_into
from space_robot_model.robot import Robot
from space_robot_model.robot.kinematics import mounted_tool

Array = NDArray[np.float64]


class ToolPose(NamedTuple):
    """Pose of a tool on inertial axes, with the base's attitude held."""

    position: Array
    """(3,) m, from the robot's centre of mass."""
    from_base: Array
    """(3,) m, from the base's frame."""
    rotation: Array
    """(3, 3) from the tool's frame."""
    jacobian: Array
    """(6, N) ``J_held``."""
    free_jacobian: Array
    """(6, N) ``J_g``."""


class ToolFollower:
    """The tool of a robot whose joints are all actuated, and the joints that lead it."""

    def __init__(self, robot: Robot, tool: str | None) -> None:
        """Take a tool by name; None: the first.

        Raises:
            InputError: there is no such tool.
        """
        self._robot, self._mounted = robot, mounted_tool(robot, tool)
        self._work = ToolKinematics.allocate(robot.joint_count)
        self._rows = list(robot.model_rows)

    def pose(self, quaternion: Array, joints: Array) -> ToolPose:
        """Return the pose of the tool at an attitude (4,) and joint positions (N,)."""
        columns, work = np.empty(len(joints)), self._work
        columns[self._rows] = joints
        tool_kinematics_into(self._robot.model, quaternion, columns, *self._mounted, work)
        return ToolPose(
            work.position.copy(),
            work.position + work.centre_of_mass,
            work.rotation.copy(),
            work.held[:, self._rows],
            work.free[:, self._rows],
        )

    def coupling(self, quaternion: Array, joints: Array) -> Array:
        """Return (3, N) ``H~_wm``: angular momentum by joint velocities, see `ToolKinematics`."""
        self.pose(quaternion, joints)
        return self._work.coupling[:, self._rows]

    def follow(
        self,
        quaternions: Array,
        positions: Array,
        rotations: Array,
        from_base: bool,
        start: Array,
        momentum_weight: float = 0.0,
    ) -> tuple[Array, int]:
        """Return joint positions (K, N), and how many of the K poses were reached.

        Args: see `follow_path_into`; ``start`` (N,) is the posture at the first pose.
        """
        out, first = np.zeros((len(positions), len(start))), np.empty(len(start))
        first[self._rows] = start
        reached = follow_path_into(
            self._robot.model,
            quaternions,
            positions,
            rotations,
            from_base,
            *self._mounted,
            momentum_weight,
            first,
            self._work,
            out,
        )
        return out[:, self._rows], int(reached)

    def follow_free(
        self,
        positions: Array,
        rotations: Array,
        twists: Array,
        spacing: float,
        start: Array,
        quaternion: Array,
    ) -> tuple[Array, Array, float]:
        """Return joint positions (K, N) and attitudes (K, 4) of a free base, and the largest error.

        For the arguments see `follow_free_path_into`; ``start`` (N,) and ``quaternion`` (4,) are
        those at the first pose.
        """
        count = len(positions) // 2 + 1
        out, attitudes = np.empty((count, len(start))), np.empty((count, 4))
        out[0, self._rows], attitudes[0] = start, quaternion
        error = follow_free_path_into(
            self._robot.model,
            positions,
            rotations,
            twists,
            spacing,
            *self._mounted,
            FreeBase.allocate(self._robot.joint_count),
            out,
            attitudes,
        )
        return out[:, self._rows], attitudes, float(error)
