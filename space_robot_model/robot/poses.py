"""Poses of all frames of a robot in one state, relative to their parents, for /tf.

The same as `space_robot_model.robot.transforms` for one tick of a running flight; constant parts
are computed once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.samples import RobotState
from space_robot_msgs_py.topics import INERTIAL_FRAME
from space_robot_msgs_py.wire.poses import POSE
from space_robot_msgs_py.wire.tf import Frame

from ..elementary.functions import sines_cosines
from .frame_names import frame_names
from .robot import Robot
from .transforms import Transform, joint_transforms, tool_transforms

Array = NDArray[np.float64]

XYZW = [1, 2, 3, 0]
"""Indices that bring a quaternion ``[w, x, y, z]`` into ROS's order."""


class RobotPoses:
    """Poses of the base in the inertial frame, then of each body relative to its parent."""

    def __init__(self, robot: Robot) -> None:
        """Compute the poses at joint positions zero."""
        joints = joint_transforms(robot, np.zeros((1, robot.joint_count)))
        self.frames = (Frame(INERTIAL_FRAME, frame_names(robot).bodies[0]), *map(_frame, joints))
        """Frames in the order of the poses."""
        self._poses = np.empty((1 + len(joints), POSE))
        self._poses[1:] = [_pose(transform) for transform in joints]
        order = np.array(robot.order, np.intp)
        slides = robot.is_prismatic[order]
        self._sliding, self._turning = order[slides], order[~slides]
        self._slid, self._turned = 1 + np.flatnonzero(slides), 1 + np.flatnonzero(~slides)
        self._origins = self._poses[self._slid, :3]
        self._axes = np.array([robot.rotation[j][:, 2] for j in self._sliding]).reshape(-1, 3)
        x, y, z, w = self._poses[self._turned, 3:].T
        # factors of the cosine and of the sine in q0 (cos theta/2, 0, 0, sin theta/2)
        self._even, self._odd = np.column_stack((x, y, z, w)), np.column_stack((y, -x, w, -z))

    def at(self, state: RobotState) -> Array:
        """Return translations, m, and quaternions x, y, z, w, (M, 7); reused by the next call."""
        poses, joints = self._poses, np.append(state.joint_positions, state.passive_positions)
        poses[0, :3], poses[0, 3:] = state.base_position, state.quaternion[XYZW]
        s, c = sines_cosines(0.5 * joints[self._turning])
        poses[self._turned, 3:] = c[:, np.newaxis] * self._even + s[:, np.newaxis] * self._odd
        along = joints[self._sliding, np.newaxis] * self._axes
        poses[self._slid, :3] = self._origins + along
        return poses


def tool_poses(robot: Robot) -> tuple[tuple[Frame, ...], Array]:
    """Return the tools' frames and their constant poses (M, 7)."""
    tools = tool_transforms(robot)
    return tuple(map(_frame, tools)), np.array([_pose(tool) for tool in tools]).reshape(-1, POSE)


def _frame(transform: Transform) -> Frame:
    return Frame(transform.parent, transform.child)


def _pose(transform: Transform) -> Array:
    return np.append(transform.position[0], transform.quaternion[0, XYZW])
