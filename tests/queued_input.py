"""A subscription without ROS: the test puts in what it hears."""

from __future__ import annotations

from collections import deque

from space_robot_msgs_py import topics
from space_robot_msgs_py.wire.source_guard import SourceGuard

MS = 1_000_000


class QueuedInput:
    """A `FollowedSubscription` that hears what the test sends."""

    def __init__(self, node: object, topic: topics.Topic, group: object, depth: int = 1) -> None:
        self.topic, self.source = topic, SourceGuard()
        self._sent: deque[tuple[bytes, int]] = deque()

    def send(self, data: bytes, sequence: int) -> None:
        self._sent.append((data, sequence))

    def take(self) -> bytes | None:
        while self._sent:
            data, sequence = self._sent.popleft()
            if self.source.passes(sequence, MS):
                return data
        return None
