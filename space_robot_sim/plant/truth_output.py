"""The true states as messages, for the recorder: beside the measured ones, where the two differ."""

from __future__ import annotations

from rclpy.node import Node

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.endpoints import RawPublisher
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.codecs import TruthCodec

from .plant import Plant


class TruthOutput:
    """Sends the truth of a tick, if what the plant measures can ever be something else."""

    def __init__(self, node: Node, plant: Plant, timebase: Timebase) -> None:
        """Open the topics, or none."""
        self._codec = TruthCodec(plant.robot.joint_names, timebase)
        self.outputs: tuple[RawPublisher, ...] = ()
        if not plant.measures_truth:
            self.outputs = tuple(RawPublisher(node, topic) for topic in topics.TRUTH)

    def send(self, truth: RobotState) -> None:
        """Publish both messages; best once the tick's state is out and is being answered."""
        if self.outputs:
            for output, data in zip(self.outputs, self._codec.encode(truth), strict=True):
                output.publish(data)
