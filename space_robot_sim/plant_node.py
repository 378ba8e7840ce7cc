"""plant_node: steps the plant against the commands of the graph."""

from __future__ import annotations

from typing import NoReturn

from space_robot_msgs_py.ros.node_host import NodeHost, run_node

from .plant.loop import PlantLoop
from .plant.settings import PlantNodeSettings


def make_loop(host: NodeHost, settings: PlantNodeSettings) -> PlantLoop:
    """The loop that the settings ask for."""
    if any(settings.faults):
        from .plant.faulty_loop import FaultyPlantLoop

        return FaultyPlantLoop(host, settings)
    return PlantLoop(host, settings)


def main() -> NoReturn:
    """Entry point of plant_node."""
    run_node(PlantNodeSettings, make_loop)


if __name__ == "__main__":
    main()
