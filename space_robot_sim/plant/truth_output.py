"""The true states as messages, for the recorder: beside the measured ones, where the two differ."""

from __future__ import annotations

from rclpy.node import Node

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.endpoints import RawPublisher
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.truth_writer import Messages, TruthWriter

from .plant import Plant


class TruthOutput:
    """Sends the truth of a tick, if what the plant measures can ever be something else."""

    def __init__(self, node: Node, plant: Plant, timebase: Timebase) -> None:
        """Open the topics, or none."""
        self._writer = TruthWriter(plant.names, timebase)
        self._outputs: dict[topics.Topic, RawPublisher] = {}
        if not plant.measures_truth:
            self._outputs = {topic: RawPublisher(node, topic) for topic in topics.TRUTH}
        self.outputs = tuple(self._outputs.values())

    def send(self, truth: RobotState) -> None:
        """Take a tick's truth; best once its state is out and is being answered."""
        if self.outputs:
            self._publish(self._writer.add(truth))

    def flush(self) -> None:
        """Publish what is kept back."""
        self._publish(self._writer.flush())

    def _publish(self, messages: Messages) -> None:
        for topic, data in messages:
            self._outputs[topic].publish(data)
