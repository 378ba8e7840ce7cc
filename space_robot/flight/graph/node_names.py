"""The nodes of a flight: their names, whom they wait for, and the user's own in place of some."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Any

from space_robot_msgs_py import topics

from ...scenario.node_settings import SCHEMAS

ORDER = ("recorder", "mission", "controller", "plant")
"""The order in which they are activated."""
NODE_NAMES = tuple(f"{node}_node" for node in ORDER)
"""Names of nodes and executables, in that order."""
PLANT = NODE_NAMES[-1]
MISSION = NODE_NAMES[1]
CONTROLLER_NODE = NODE_NAMES[2]


def started_nodes(without: Collection[str]) -> tuple[str, ...]:
    """Return the names of the nodes that a flight starts, in `ORDER`."""
    return tuple(f"{node}_node" for node in ORDER if node not in without)


_TO_CONTROLLER = ("controller_node", "recorder_node")

LISTENERS = {
    **dict.fromkeys((*topics.RECORDED, topics.PLANT_DESCRIPTION), ("recorder_node",)),
    **dict.fromkeys((t for t in topics.STATES if t.is_controlling), _TO_CONTROLLER),
    topics.REFERENCE_JOINTS: _TO_CONTROLLER,
    topics.REFERENCE_BASE: _TO_CONTROLLER,
    topics.COMMAND: (PLANT, "recorder_node"),
    topics.CLOCK: ("mission_node", "recorder_node"),
}
"""Nodes of the graph that subscribe to each topic."""


def reset_with(absent: Collection[str] = ()) -> list[str]:
    """Return the parameter ``reset_with`` of the plant: the others as they are activated."""
    return [name for name in NODE_NAMES if name not in (PLANT, *absent)]


def wait_for(node: str, absent: Collection[str] = ()) -> list[str]:
    """Return the parameter ``wait_for`` of a node in a whole graph.

    ``absent``: nodes that have ended, or are not started.
    """
    (sends,) = (schema.sends for schema in SCHEMAS if schema.node == node)
    return [
        f"{name}:{topic.name}" for topic in sends for name in LISTENERS[topic] if name not in absent
    ]


AWAITED = {
    "controller": (topics.COMMAND,),
    "mission": (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE),
}
"""Topics that must be published in place of a node."""


def published_topics(nodes: Sequence[str]) -> list[topics.Topic]:
    """Return the topics that nodes of these names must or may publish."""
    may = [topic for schema in SCHEMAS if schema.node in nodes for topic in schema.sends]
    return list(dict.fromkeys([*may, *(topic for node in nodes for topic in AWAITED[node])]))


class OwnNodes:
    """Describes what a flight waits for, and what has come."""

    def __init__(self, node: Any, without: Sequence[str], timeout_s: float) -> None:
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
        from space_robot_msgs_py.ros.endpoints import full_node_name

        come = []
        for node in list(self._missing):
            infos = [self._node.get_publishers_info_by_topic(t.name) for t in AWAITED[node]]
            if all(infos):
                names = sorted({full_node_name(info) for each in infos for info in each})
                come.append(f"your {node} is {', '.join(names)}")
                self._missing.remove(node)
        return "; ".join(come)

    def _names(self, node: str) -> str:
        return " and ".join(self._node.resolve_topic_name(t.name) for t in AWAITED[node])
