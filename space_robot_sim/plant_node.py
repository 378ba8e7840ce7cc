"""plant_node: steps the plant against the commands of the graph."""

from __future__ import annotations

from typing import NoReturn

from space_robot_msgs_py.ros.managed_node import NodeKind
from space_robot_msgs_py.ros.node_host import run_nodes

from .plant.loop import PlantLoop
from .plant.services import offer_services
from .plant.settings import PlantNodeSettings

NODE = NodeKind(PlantNodeSettings, PlantLoop, offer_services=offer_services)


def main() -> NoReturn:
    """Entry point of plant_node."""
    run_nodes(NODE)


if __name__ == "__main__":
    main()
