"""Subscription to a part of the state that keeps the newest rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.topics import Topic
from space_robot_msgs_py.wire.messages import Codec, describe

if TYPE_CHECKING:
    from rclpy.node import Node

    from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup

Array = NDArray[np.float64]

KEPT = 4
"""Number of kept messages per topic, so that all topics have one of the same tick."""


class StateTopic:
    """Subscription to a topic that keeps the last row of the newest messages."""

    def __init__(self, node: Node, group: PolledCallbackGroup, topic: Topic) -> None:
        """Subscribe to a topic, with best effort.

        They can be read after `describe` was called; earlier messages are kept.
        """
        from space_robot_msgs_py.ros.endpoints import RawSubscription

        self._topic = topic
        self._subscription = RawSubscription(node, topic, group, KEPT, best_effort=True)
        self.rows: dict[int, Array] = {}
        """Last row of each of the newest messages, by its stamp, ns."""

    def describe(self, names: RobotNames, timebase: Timebase) -> None:
        """Set the robot of the messages, and the period of its ticks."""
        self._description = describe(self._topic, names, timebase)
        self._codec = Codec(self._description)
        self._period_ns = timebase.period_ns

    def take(self) -> None:
        """Read received messages; those of other robots are ignored."""
        while (data := self._subscription.take()) is not None:
            try:
                stamp_ns, numbers = self._codec.decode(data)
            except MessageError:
                continue
            rows = numbers.reshape(-1, self._description.width)
            self.rows[stamp_ns + (len(rows) - 1) * self._period_ns] = rows[-1].copy()
        while len(self.rows) > KEPT:
            del self.rows[next(iter(self.rows))]

    def fill(self, state: RobotState, stamp_ns: int) -> None:
        """Write the row with a stamp into the topic's columns of ``state``."""
        row, at = self.rows[stamp_ns], 0
        for column in self._description.columns:
            target = getattr(state, column.name)
            target[column.first : column.first + column.length] = row[at : at + column.length]
            at += column.length

    def close(self) -> None:
        """End the subscription."""
        self._subscription.close()
