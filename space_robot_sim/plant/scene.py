"""Description and poses of the robot for viewers. Independent of ROS.

Names of frames are those of the description, in a namespace with that before them
(``sat1/base_link``), as robot_state_publisher's ``frame_prefix`` does it. All robots share the
inertial frame.
"""

from __future__ import annotations

from collections.abc import Sequence

from space_robot_model.robot import Robot
from space_robot_model.robot.placements import RobotPoses, tool_poses
from space_robot_model.robot.urdf_text import urdf_text
from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.telemetry import Messages
from space_robot_msgs_py.wire.viewers import FramePair, TransformsCodec, robot_description, wrap

PERIOD_NS = 10_000_000
"""Least time between two messages on /tf: 100 Hz."""


class SceneWriter:
    """Writer of the messages of `topics.SCENE` from the true state of a robot."""

    def __init__(self, robot: Robot, timebase: Timebase, namespace: str = topics.ROOT) -> None:
        """``namespace``: the robot's."""
        self._robot, self._prefix = robot, f"{namespace}/".lstrip("/")
        self._timebase = timebase
        self._every = -(-PERIOD_NS // timebase.period_ns)
        self._poses = RobotPoses(robot)
        self._codec = TransformsCodec(self._named(self._poses.frames), timebase)

    def lasting(self) -> Messages:
        """Yield the messages that are valid for the whole flight."""
        frames, poses = tool_poses(self._robot)
        static = TransformsCodec(self._named(frames), self._timebase).encode(0, poses)
        yield topics.ROBOT_DESCRIPTION, robot_description(urdf_text(self._robot))
        yield topics.TRANSFORMS_STATIC, wrap(static)

    def is_due(self, tick: int) -> bool:
        """Return True if the poses are due at a tick."""
        return tick % self._every == 0

    def poses(self, truth: RobotState) -> Messages:
        """Yield the poses of a true state."""
        yield topics.TRANSFORMS, wrap(self._codec.encode(truth.tick, self._poses.at(truth)))

    def _named(self, frames: Sequence[FramePair]) -> list[FramePair]:
        return [FramePair(self._full(frame.parent), self._full(frame.child)) for frame in frames]

    def _full(self, name: str) -> str:
        return name if name == topics.INERTIAL_FRAME else self._prefix + name
