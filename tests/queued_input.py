"""A subscription without ROS: the test puts in what it hears."""

from __future__ import annotations

from collections import deque

from space_robot_msgs_py import topics


class QueuedInput:
    """A `RawSubscription` that hears what the test sends."""

    def __init__(self, node: object, topic: topics.Topic, group: object, depth: int = 1) -> None:
        self.topic, self.full_name = topic, topic.full_name
        self._sent: deque[bytes] = deque()

    def send(self, data: bytes) -> None:
        self._sent.append(data)

    def take(self) -> bytes | None:
        return self._sent.popleft() if self._sent else None
