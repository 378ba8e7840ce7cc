"""Subscribers of each topic in a flight that the nodes wait for."""

from __future__ import annotations

from collections.abc import Collection

from space_robot_msgs_py import topics

from ...scenario.node_settings import SCHEMAS
from .node_names import NODE_NAMES, PLANT

_TO_CONTROLLER = ("controller_node", "recorder_node")

LISTENERS = {
    **{
        topic: _TO_CONTROLLER if topic.is_controlling else ("recorder_node",)
        for topic in topics.STATES
    },
    topics.COMMAND: (PLANT, "recorder_node"),
    topics.REFERENCE_JOINTS: _TO_CONTROLLER,
    topics.REFERENCE_BASE: _TO_CONTROLLER,
    topics.TELEMETRY: ("recorder_node",),
    topics.SIGNALS: ("recorder_node",),
    topics.LAW: ("recorder_node",),
    topics.CLOCK: ("mission_node", "recorder_node"),
    topics.TRUTH_JOINTS: ("recorder_node",),
    topics.TRUTH_BASE: ("recorder_node",),
    topics.TRUTH_ORBIT: ("recorder_node",),
    **dict.fromkeys((*topics.SCENE, topics.PLANT_DESCRIPTION), ("recorder_node",)),
}
"""Nodes of the graph that subscribe to each topic."""


def reset_with(absent: Collection[str] = ()) -> list[str]:
    """Return the parameter ``reset_with`` of the plant: the others as they are activated."""
    return [name for name in NODE_NAMES if name not in (PLANT, *absent)]


def wait_for(node: str, absent: Collection[str] = ()) -> list[str]:
    """Return the parameter ``wait_for`` of the plant or the controller in a whole graph.

    ``absent``: nodes that have ended, or are not started.
    """
    (sends,) = (schema.sends for schema in SCHEMAS if schema.node == node)
    return [
        f"{name}:{topic.name}" for topic in sends for name in LISTENERS[topic] if name not in absent
    ]
