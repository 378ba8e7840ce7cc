"""Output of the robot for viewers: to the recorder, and as /tf and markers if installed."""

from __future__ import annotations

from importlib.util import find_spec

from rclpy.node import Node

from space_robot_model.robot import Robot
from space_robot_model.robot.markers import RobotMarkers
from space_robot_model.robot.placements import RobotPoses
from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.endpoints import RawPublisher
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.viewers import no_markers, unwrap

from .scene import Messages, SceneWriter


class SceneOutput:
    """Publisher of the robot's description, once, and poses at 100 Hz simulated time."""

    def __init__(self, node: Node, robot: Robot, timebase: Timebase) -> None:
        """Open the topics."""
        self._writer = SceneWriter(robot, timebase, node.get_namespace())
        self._outputs = {topic: RawPublisher(node, topic) for topic in topics.SCENE}
        self._shared = {
            topic: RawPublisher(node, topic.carries)
            for topic in topics.SCENE
            if topic.carries and find_spec(topic.carries.type.partition("/")[0])
        }
        """Topics of all robots, that others may publish, too."""
        self.outputs = tuple(self._outputs.values())
        self._markers = None
        if find_spec(topics.MARKERS.type.partition("/")[0]):
            self._markers = MarkerOutput(node, robot, timebase)
        self.viewed = (*self._shared.values(), *(self._markers.outputs if self._markers else ()))
        """Topics that only viewers listen to."""
        self._has_begun = False

    def begin(self) -> None:
        """Send what holds for the whole flight, once: who comes later gets it, too."""
        if not self._has_begun:
            self._has_begun = True
            self._publish(self._writer.lasting())

    def send(self, truth: RobotState) -> None:
        """Send the poses, if they are due; best once the tick's state is being answered."""
        if self._writer.is_due(truth.tick):
            self._publish(self._writer.poses(truth))
        if self._markers:
            self._markers.send(truth)

    def show(self, truth: RobotState) -> None:
        """Send viewers, not the recorder, the poses of a true state, due or not."""
        for topic, data in self._writer.poses(truth):
            if topic in self._shared:
                self._shared[topic].publish(unwrap(data))
        if self._markers:
            self._markers.show(truth)

    def _publish(self, messages: Messages) -> None:
        for topic, data in messages:
            self._outputs[topic].publish(data)
            if topic in self._shared:
                self._shared[topic].publish(unwrap(data))


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
