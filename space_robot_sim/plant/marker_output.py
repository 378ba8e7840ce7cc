"""Output of markers for viewers, while one subscribes."""

from __future__ import annotations

from rclpy.node import Node

from space_robot_model.robot import Robot
from space_robot_model.robot.markers import RobotMarkers
from space_robot_model.robot.poses import RobotPoses
from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.endpoints import RawPublisher
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.markers import no_markers

PERIOD_NS = 33_333_333
"""Least simulated time between two messages: 30 Hz."""


class MarkerOutput:
    """Publisher of the robot's shapes at 30 Hz simulated time, while a viewer subscribes."""

    def __init__(self, node: Node, robot: Robot, timebase: Timebase) -> None:
        """Open the topic."""
        prefix = f"{node.get_namespace()}/".lstrip("/")
        self._poses, self._markers = RobotPoses(robot), RobotMarkers(robot, timebase, prefix)
        self._every = -(-PERIOD_NS // timebase.period_ns)
        self._output = RawPublisher(node, topics.MARKERS)
        self.outputs = (self._output,)

    def send(self, truth: RobotState) -> None:
        """Send the shapes of a true state, if they are due."""
        if truth.tick % self._every == 0:
            self.show(truth)

    def show(self, truth: RobotState) -> None:
        """Send the shapes of a true state, if somebody listens."""
        if not self._output.listener_count:
            return
        if not self._output.sent:  # those of the flight before may have other names
            self._output.publish(no_markers())
        self._output.publish(self._markers.encode(truth.tick, self._poses.at(truth)))
