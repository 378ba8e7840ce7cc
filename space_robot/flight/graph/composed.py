"""All nodes of a flight in one process, stepped in turn, for ``fly --composed``.

They are the nodes of the other flights: only their process is one, so a tick wakes nobody.
"""

from __future__ import annotations

from typing import NoReturn

NAME = "composed"
"""Name of the process in a graph."""


def main() -> NoReturn:
    """Run the four nodes."""
    from space_robot_control import controller_node, mission_node
    from space_robot_msgs_py import recorder_node
    from space_robot_msgs_py.ros.node_host import run_nodes
    from space_robot_sim import plant_node

    run_nodes(recorder_node.NODE, mission_node.NODE, controller_node.NODE, plant_node.NODE)


if __name__ == "__main__":
    main()
