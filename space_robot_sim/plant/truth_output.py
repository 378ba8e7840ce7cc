"""Output of the true states for the recorder, if they differ from the measured ones."""

from __future__ import annotations

from rclpy.node import Node

from space_robot_msgs_py.ros.endpoints import RawPublisher
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.telemetry import Messages, TruthWriter

from .plant import Plant


class TruthOutput:
    """Publisher of what of the true state of a tick its measurements cannot tell."""

    def __init__(self, node: Node, plant: Plant, timebase: Timebase) -> None:
        """Open the topics, or none."""
        self._writer = TruthWriter(plant.names, timebase, plant.truth_topics)
        self._outputs = {topic: RawPublisher(node, topic) for topic in plant.truth_topics}
        self.outputs = tuple(self._outputs.values())

    def send(self, truth: RobotState) -> None:
        """Take a tick's truth; best once its state is out and is being answered."""
        if self.outputs:
            self._publish(self._writer.add(truth))

    def flush(self) -> None:
        """Publish the buffered messages."""
        self._publish(self._writer.flush())

    def _publish(self, messages: Messages) -> None:
        for topic, data in messages:
            self._outputs[topic].publish(data)
