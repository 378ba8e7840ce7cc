"""Subscription that accepts messages only from the topic's own publisher."""

from __future__ import annotations

from rclpy.node import Node

from ..topics import Topic
from ..wire.sources import Sources
from .endpoints import PolledCallbackGroup, RawSubscription
from .exclusive import GraphPublishers

MOST_REFUSED = 1_000
"""Maximum number of foreign messages ignored per call of `take`."""


class TrustedSubscription(RawSubscription):
    """Distinguishes publishers by the identity (GID) in each message, see `Sources`.

    Messages without identity (`serialized_take`) are accepted as the topic's own publisher's.
    """

    def __init__(
        self, node: Node, topic: Topic, group: PolledCallbackGroup, depth: int = 0
    ) -> None:
        super().__init__(node, topic, group, depth)
        self._sources = Sources(topic.name, GraphPublishers(node))

    def take(self) -> bytes | None:
        """Take the next message of the topic's own publisher; None if there is none."""
        is_ours = self._sources.take
        for _ in range(MOST_REFUSED):
            taken = self.take_with_source()
            if taken is None:
                return None
            if is_ours(taken.publisher, taken.sequence):
                return taken.data
        return None

    def counts(self, word: str) -> dict[str, int]:
        """Return the number of foreign messages, which were ``word``, for a node's health."""
        count = self._sources.foreign
        return {f"{word}: another publisher's on {self.full_name}": count} if count else {}
