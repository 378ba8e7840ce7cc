"""Nodes of the user's own in a flight that starts the others: ``fly --without``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from space_robot_msgs_py import topics

from ...scenario.node_settings import SCHEMAS

AWAITED = {
    "controller": (topics.COMMAND,),
    "mission": (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE),
}
"""Topics that must be published in place of a node."""


def topics_of(nodes: Sequence[str]) -> list[topics.Topic]:
    """Return the topics that nodes of these names must or may publish."""
    may = [topic for schema in SCHEMAS if schema.node in nodes for topic in schema.sends]
    return [*may, *(topic for node in nodes for topic in AWAITED[node])]


class OwnNodes:
    """Describes what a flight waits for, and what has come."""

    def __init__(self, node: Any, without: Sequence[str], timeout_s: float) -> None:
        """Store the names.

        Args:
            node: an rclpy node to look with.
            without: nodes that the flight does not start.
            timeout_s: how long it waits for others, s of the wall clock; 0: no limit.
        """
        self._node, self._missing = node, list(without)
        self.timeout_s = (timeout_s or math.inf) if without else 0.0

    @property
    def awaited(self) -> str:
        """Describe the nodes that have not come yet; empty if there are none."""
        if not self._missing:
            return ""
        nodes = " and ".join(
            f"your {node} (a node that publishes {self._names(node)})" for node in self._missing
        )
        domain = self._node.context.get_domain_id()
        limit = "" if self.timeout_s == math.inf else f", at most {self.timeout_s:g} s"
        return f"{nodes} in ROS domain {domain}{limit}"

    def arrived(self) -> str:
        """Describe nodes that have come since the last call; empty if there are none."""
        from space_robot_msgs_py.ros.endpoints import full_name_of

        come = []
        for node in list(self._missing):
            infos = [self._node.get_publishers_info_by_topic(t.name) for t in AWAITED[node]]
            if all(infos):
                names = sorted({full_name_of(info) for each in infos for info in each})
                come.append(f"your {node} is {', '.join(names)}")
                self._missing.remove(node)
        return "; ".join(come)

    def _names(self, node: str) -> str:
        return " and ".join(self._node.resolve_topic_name(t.name) for t in AWAITED[node])
