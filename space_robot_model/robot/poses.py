"""The poses of all frames of a robot at one state, each on its parent: what /tf tells.

As `space_robot_model.robot.transforms`, for one tick of a running flight: all that does not change
is computed once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.samples import RobotState
from space_robot_msgs_py.topics import INERTIAL_FRAME
from space_robot_msgs_py.wire.poses import POSE
from space_robot_msgs_py.wire.tf import Frame

from ..elementary.sine import sines_cosines
from .frame_names import frame_names
from .robot import Robot
from .transforms import Transform, joint_transforms, tool_transforms

Array = NDArray[np.float64]

XYZW = [1, 2, 3, 0]
"""ROS's order of a quaternion ``[w, x, y, z]``."""


class RobotPoses:
    """Poses of the base on the inertial frame, then of each body on the one that carries it."""

    def __init__(self, robot: Robot) -> None:
        """Compute the poses at zero."""
        joints = joint_transforms(robot, np.zeros((1, robot.joint_count)))
        self.frames = (Frame(INERTIAL_FRAME, frame_names(robot).bodies[0]), *map(_frame, joints))
        """In the order of the poses."""
        self._poses = np.empty((1 + len(joints), POSE))
        self._poses[1:] = [_pose(transform) for transform in joints]
        order = np.array(robot.order, np.intp)
        slides = robot.is_prismatic[order]
        self._sliding, self._turning = order[slides], order[~slides]
        self._slid, self._turned = 1 + np.flatnonzero(slides), 1 + np.flatnonzero(~slides)
        self._origins = self._poses[self._slid, :3]
        self._axes = np.array([robot.rotation[j][:, 2] for j in self._sliding]).reshape(-1, 3)
        x, y, z, w = self._poses[self._turned, 3:].T
        # of q0 (cos theta/2, 0, 0, sin theta/2) what goes with the cosine, and with the sine
        self._even, self._odd = np.column_stack((x, y, z, w)), np.column_stack((y, -x, w, -z))

    def at(self, state: RobotState) -> Array:
        """Return (M, 7) translation, m, and rotation x, y, z, w of each; overwritten next time."""
        poses, joints = self._poses, np.append(state.joint_positions, state.passive_positions)
        poses[0, :3], poses[0, 3:] = state.base_position, state.quaternion[XYZW]
        s, c = sines_cosines(0.5 * joints[self._turning])
        poses[self._turned, 3:] = c[:, np.newaxis] * self._even + s[:, np.newaxis] * self._odd
        along = joints[self._sliding, np.newaxis] * self._axes
        poses[self._slid, :3] = self._origins + along
        return poses


def tool_poses(robot: Robot) -> tuple[tuple[Frame, ...], Array]:
    """Return the tools' frames and their poses (M, 7), which never change."""
    tools = tool_transforms(robot)
    return tuple(map(_frame, tools)), np.array([_pose(tool) for tool in tools]).reshape(-1, POSE)


def _frame(transform: Transform) -> Frame:
    return Frame(transform.parent, transform.child)


def _pose(transform: Transform) -> Array:
    return np.append(transform.position[0], transform.quaternion[0, XYZW])
