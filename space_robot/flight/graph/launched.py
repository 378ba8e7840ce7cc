"""Parameters of a flight whose nodes are started by a launch file."""

from __future__ import annotations

from pathlib import Path

from ..bag_path import check_bag_path
from ..compilation import compile_kernels
from ..plan import Flight
from .composed import write_parameters
from .orchestrator import flight_parameters, with_files


def launched_parameters(flight: Flight, bag: Path, autostart: bool, folder: Path) -> Path:
    """Write a ROS parameter file for the nodes of a flight to ``folder``; return its path.

    All kernels are compiled first; else every node would compile them.

    Args:
        flight: a checked plan.
        bag: the folder to record to.
        autostart: whether the nodes configure and activate themselves; they wait for one another.
        folder: for this file, and those that it names.

    Raises:
        InputError: the bag cannot be made.
    """
    check_bag_path(bag)
    compile_kernels(bool(flight.plant.names.actuators))
    parameters = with_files(flight_parameters(flight, bag), flight, folder)
    started = {node: {**values, "autostart": autostart} for node, values in parameters.items()}
    return write_parameters(started, folder)
