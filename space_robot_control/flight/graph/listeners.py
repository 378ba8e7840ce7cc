"""Who listens to what in a flight, and whom the nodes wait for."""

from __future__ import annotations

from space_robot_msgs_py import topics

_TO_CONTROLLER = ("controller_node", "recorder_node")

LISTENERS = {
    topics.JOINT_STATES: _TO_CONTROLLER,
    topics.BASE_STATE: _TO_CONTROLLER,
    topics.COMMAND: ("plant_node", "recorder_node"),
    topics.REFERENCE_JOINTS: _TO_CONTROLLER,
    topics.REFERENCE_BASE: _TO_CONTROLLER,
    topics.TELEMETRY: ("recorder_node",),
    topics.LAW: ("recorder_node",),
    topics.CLOCK: ("mission_node", "recorder_node"),
}
"""Nodes of the graph that subscribe to each topic."""
_SENT = {
    "plant": (topics.JOINT_STATES, topics.BASE_STATE, topics.CLOCK),
    "controller": (topics.COMMAND, topics.TELEMETRY, topics.LAW),
}


def wait_for(node: str) -> list[str]:
    """The parameter ``wait_for`` of the plant or the controller in a whole graph."""
    return [f"{name}:{topic.name}" for topic in _SENT[node] for name in LISTENERS[topic]]
