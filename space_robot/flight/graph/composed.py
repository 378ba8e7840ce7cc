"""All nodes of a flight in one process, stepped in turn, for ``fly --composed``.

They are the nodes of the other flights: only their process is one, so a tick wakes nobody.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from .node_server import Program
from .processes import ros_arguments

NAME = "composed"
"""Name of the process in a graph."""


def composed_command(
    parameters: Mapping[str, Mapping[str, Any]], namespace: str, folder: Path
) -> Program:
    """Return the program of the process, with the parameters of each node.

    They are written to a file in ``folder``: on a command line, ROS takes a parameter for a node
    that is named for one in the root namespace.
    """
    file = write_parameters(parameters, folder)
    arguments = ros_arguments({}, namespace) or ["--ros-args"]
    return Program(__name__, [*arguments, "--params-file", str(file)])


def write_parameters(parameters: Mapping[str, Mapping[str, Any]], folder: Path) -> Path:
    """Write a ROS parameter file of all nodes to ``folder``; return its path."""
    content = {
        f"/**/{node}_node": {"ros__parameters": values} for node, values in parameters.items()
    }
    file = folder / "parameters.yaml"
    file.write_text(json.dumps(content), encoding="utf-8")  # JSON is YAML, which ROS reads
    return file


def main() -> NoReturn:
    """Run the four nodes."""
    from space_robot_control import controller_node, mission_node
    from space_robot_msgs_py import recorder_node
    from space_robot_msgs_py.ros.node_host import run_nodes
    from space_robot_sim import plant_node

    run_nodes(recorder_node.NODE, mission_node.NODE, controller_node.NODE, plant_node.NODE)


if __name__ == "__main__":
    main()
