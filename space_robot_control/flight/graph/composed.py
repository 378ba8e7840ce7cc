"""All nodes of a flight in one process, stepped in turn: what ``fly --composed`` starts.

They are the nodes of the other flights: only their process is one, so a tick wakes nobody.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn

from space_robot_msgs_py.ros.run_module import module_command

from .processes import ros_arguments

NAME = "composed"
"""The process' name among those of a graph."""


def composed_command(parameters: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The command line of the process, with the parameters of each node."""
    arguments = [
        argument
        for node, values in parameters.items()
        for argument in ros_arguments(values, f"{node}_node")
    ]
    return [*module_command(__name__), *arguments]


def main() -> NoReturn:
    """Run the four nodes."""
    from space_robot_msgs_py import recorder_node
    from space_robot_msgs_py.ros.node_host import run_nodes
    from space_robot_sim import plant_node

    from ... import controller_node, mission_node

    run_nodes(recorder_node.NODE, mission_node.NODE, controller_node.NODE, plant_node.NODE)


if __name__ == "__main__":
    main()
