"""plant_node: steps the plant against the commands of the graph."""

from __future__ import annotations

from typing import NoReturn

from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.ros.node_host import NodeKind, run_nodes

from .plant.loop import PlantLoop
from .plant.settings import PlantNodeSettings


def make_loop(node: ManagedNode[PlantNodeSettings], settings: PlantNodeSettings) -> PlantLoop:
    """Return the loop that the settings ask for."""
    if any(settings.faults):
        from .plant.faulty_loop import FaultyPlantLoop

        return FaultyPlantLoop(node, settings)
    return PlantLoop(node, settings)


NODE = NodeKind(PlantNodeSettings, make_loop)


def main() -> NoReturn:
    """Entry point of plant_node."""
    run_nodes(NODE)


if __name__ == "__main__":
    main()
