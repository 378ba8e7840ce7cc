"""One of the topics that a robot's state is sent on, with what has come on it last."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.codec import Codec
from space_robot_msgs_py.wire.message import MessageDescription

if TYPE_CHECKING:
    from rclpy.node import Node

    from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup

Array = NDArray[np.float64]

KEPT = 4
"""Messages, so that one of the same tick is there on each topic."""


class StateTopic:
    """Takes the messages of a topic; of each the last row is kept for a while."""

    def __init__(
        self, node: Node, group: PolledCallbackGroup, kind: type[MessageDescription]
    ) -> None:
        """Subscribe to the messages of a kind as they come; they are never waited for.

        They can be taken once `describe` has been called. Those that come before are kept.
        """
        from space_robot_msgs_py.ros.endpoints import RawSubscription

        self._kind = kind
        self._subscription = RawSubscription(node, kind.topic, group, KEPT, best_effort=True)
        self.rows: dict[int, Array] = {}
        """The last row of each of the newest messages, by its time in ns."""

    def describe(self, names: RobotNames, timebase: Timebase) -> None:
        """Set the robot that the messages are of, and the period of its ticks."""
        self._describe = self._kind.of_robot(names, timebase)
        self._codec = Codec(self._describe)
        self._width = sum(column.length for column in self._describe.columns)
        self._period_ns = timebase.period_ns

    def take(self) -> None:
        """Take what has come; messages that are not of this robot are passed over."""
        while (data := self._subscription.take()) is not None:
            try:
                stamp_ns, numbers = self._codec.decode(data)
            except MessageError:
                continue
            rows = numbers.reshape(-1, self._width)
            self.rows[stamp_ns + (len(rows) - 1) * self._period_ns] = rows[-1].copy()
        while len(self.rows) > KEPT:
            del self.rows[next(iter(self.rows))]

    def fill(self, state: RobotState, stamp_ns: int) -> None:
        """Put the row of a time into the columns of a state that the topic has."""
        row, at = self.rows[stamp_ns], 0
        for column in self._describe.columns:
            target = getattr(state, column.name)
            target[column.first : column.first + column.length] = row[at : at + column.length]
            at += column.length

    def close(self) -> None:
        """Take no more messages."""
        self._subscription.close()
