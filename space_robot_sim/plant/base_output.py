"""Output of the base in standard messages, for others' nodes: odometry, IMU, applied wrench."""

from __future__ import annotations

import math
from importlib.util import find_spec

import numpy as np
from rclpy.node import Node

from space_robot_model.robot.placements import XYZW, base_axes, to_base
from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.endpoints import RawPublisher
from space_robot_msgs_py.samples import RobotState
from space_robot_msgs_py.wire.viewers import BaseMessages

from .settings import PlantNodeSettings


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
