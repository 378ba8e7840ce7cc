"""Outputs of the plant's node beside the state: true states, the robot for viewers, its base."""

from __future__ import annotations

import math
from importlib.util import find_spec

import numpy as np
from rclpy.node import Node

from space_robot_model.robot import Robot
from space_robot_model.robot.markers import RobotMarkers
from space_robot_model.robot.placements import XYZW, RobotPoses, base_axes, to_base
from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.endpoints import RawPublisher
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.telemetry import Messages, TruthWriter
from space_robot_msgs_py.wire.viewers import BaseMessages, no_markers, unwrap

from .plant import Plant
from .scene import SceneWriter
from .settings import PlantNodeSettings

MARKERS_PERIOD_NS = 33_333_333
"""Least simulated time between two messages of markers: 30 Hz."""


class TruthOutput:
    """Publisher of what of the true state of a tick its measurements cannot tell."""

    def __init__(self, node: Node, plant: Plant, timebase: Timebase) -> None:
        """Open the topics, or none."""
        self._writer = TruthWriter(plant.names, timebase, plant.truth_topics)
        self._outputs = {topic: RawPublisher(node, topic) for topic in plant.truth_topics}
        self.outputs = tuple(self._outputs.values())

    def send(self, truth: RobotState) -> None:
        """Take a tick's truth."""
        if self.outputs:
            self._publish(self._writer.add(truth))

    def flush(self) -> None:
        """Publish the buffered messages."""
        self._publish(self._writer.flush())

    def _publish(self, messages: Messages) -> None:
        for topic, data in messages:
            self._outputs[topic].publish(data)


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
        """Send what holds for the whole flight, once; DDS keeps it for later subscribers."""
        if not self._has_begun:
            self._has_begun = True
            self._publish(self._writer.lasting())

    def send(self, truth: RobotState) -> None:
        """Send the poses, if they are due."""
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


class MarkerOutput:
    """Publisher of the robot's shapes at 30 Hz simulated time, while a viewer subscribes."""

    def __init__(self, node: Node, robot: Robot, timebase: Timebase) -> None:
        """Open the topic."""
        prefix = f"{node.get_namespace()}/".lstrip("/")
        self._poses, self._markers = RobotPoses(robot), RobotMarkers(robot, timebase, prefix)
        self._every = -(-MARKERS_PERIOD_NS // timebase.period_ns)
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
        if not self._output.sent:  # a viewer may still have those of an earlier flight
            self._output.publish(no_markers())
        self._output.publish(self._markers.encode(truth.tick, self._poses.at(truth)))


class BaseOutput:
    """Publisher of measured states of the base at a rate in simulated time, to subscribers only."""

    def __init__(self, node: Node, settings: PlantNodeSettings) -> None:
        """Open the topics whose types are installed, or none at rate 0."""
        rate = settings.base_topics_rate
        self._every = max(1, math.ceil(1.0 / (rate * settings.period) - 1e-9)) if rate else 0
        self._directions = settings.thrusters.unit_directions
        prefix = f"{node.get_namespace()}/".lstrip("/")
        self._messages = BaseMessages(settings.timebase, prefix)
        self._outputs = {
            topic: RawPublisher(node, topic)
            for topic in topics.STANDARD
            if self._every and find_spec(topic.type.partition("/")[0])
        }
        self.outputs = tuple(self._outputs.values())

    def send(self, state: RobotState) -> None:
        """Send the messages of a measured state, if they are due."""
        if self._every and state.tick % self._every == 0:
            self.show(state)

    def show(self, state: RobotState) -> None:
        """Send the messages of a measured state to those who subscribe."""
        heard = [topic for topic, output in self._outputs.items() if output.listener_count]
        if not heard:
            return
        pose = np.concatenate((state.base_position, state.quaternion[XYZW]))
        linear = to_base(base_axes(state.quaternion), state.base_velocity)
        twist = np.concatenate((linear, state.omega_base))
        force = state.thrusts[: len(self._directions)] @ self._directions
        wrench = np.concatenate((force, state.applied_torque[:3]))
        for topic, data in self._messages.encode(state.tick, pose, twist, wrench):
            if topic in heard:
                self._outputs[topic].publish(data)
