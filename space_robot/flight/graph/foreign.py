"""Detection of foreign nodes in the domain of a flight."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from typing import Any

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import InputError

DISCOVERY_S = 2.0
"""A node that was there before is discovered in 0.1 to 1.8 s (Fast DDS of Jazzy, measured)."""
WATCHED_S = 6.0
"""One that is discovered later has come later: the nodes warn of it, the flight goes on."""
LOOK_S = 0.1
LASTING = 10
"""Looks in a row: an own node that is just being discovered has no name yet."""


class ForeignNodes:
    """Guard against foreign publishers and duplicate node names in a domain."""

    def __init__(
        self, node: Any, names: Sequence[str], of_others: Collection[topics.Topic] = ()
    ) -> None:
        """Begin to look.

        Args:
            node: an rclpy node to look with.
            names: of the flight's nodes in its namespace.
            of_others: topics that the user's own nodes publish.
        """
        namespace = node.get_namespace().rstrip("/")
        self._node, self._names = node, [f"{namespace}/{name}" for name in names]
        self._topics = [topic.name for topic in topics.RECORDED if topic not in of_others]
        self._joined_at = self._look_at = time.monotonic()
        self._seen: Counter[str] = Counter()

    def wait(self, check: Callable[[], None]) -> None:
        """Wait until all earlier participants should be discovered.

        Args:
            check: called while waiting; raises to give up.

        Raises:
            InputError: there is a foreign publisher, or a namesake of a node.
        """
        while True:
            check()
            self._look(self._publishers() + self._namesakes())
            if time.monotonic() > self._joined_at + DISCOVERY_S and not self._seen:
                return
            time.sleep(LOOK_S)

    def watch(self) -> None:
        """Repeat the check until discovery is complete; to be called often.

        Raises:
            InputError: there is a foreign publisher.
        """
        now = time.monotonic()
        if now >= self._look_at and now < self._joined_at + WATCHED_S:
            self._look_at = now + LOOK_S
            self._look(self._publishers())

    def _look(self, names: Sequence[str]) -> None:
        self._seen = Counter({what: self._seen[what] + 1 for what in names})
        for what, times in self._seen.items():
            if times >= LASTING:
                raise InputError(
                    f"{what}: end that, or take another domain with --domain, or ROS_DOMAIN_ID"
                )

    def _publishers(self) -> list[str]:
        from space_robot_msgs_py.ros.exclusive import foreign_publishers

        publishers = foreign_publishers(self._node, self._topics, self._names)
        return [f"{topic} is also published by {', '.join(n)}" for topic, n in publishers.items()]

    def _namesakes(self) -> list[str]:
        return [
            f"another {name} is in this ROS domain"
            for name in self._names
            if self._node.count_services(f"{name}/change_state") > 1
        ]
