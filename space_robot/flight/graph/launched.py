"""A flight whose nodes are started by a launch file: their parameters, and how they end."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..bag_path import check_bag_path
from ..compilation import compile_kernels
from ..plan import Flight
from .node_names import NODE_NAMES, PLANT
from .orchestrator import flight_parameters, with_files
from .processes import write_parameters


def launched_parameters(
    flight: Flight,
    bag: Path,
    autostart: bool,
    folder: Path,
    of_ros: Mapping[str, Mapping[str, Any]],
) -> Path:
    """Write a ROS parameter file for the nodes of a flight to ``folder``; return its path.

    All kernels are compiled first; else every node would compile them.

    Args:
        flight: a checked plan.
        bag: the folder to record to.
        autostart: whether the nodes configure and activate themselves; they wait for one another.
        folder: for this file, and those that it names.
        of_ros: parameters by node that every ROS node has.
    """
    check_bag_path(bag)
    compile_kernels(bool(flight.plant.names.actuators))
    parameters = with_files(flight_parameters(flight, bag), flight, folder)
    started = {
        node: {**values, "autostart": autostart, **of_ros.get(node, {})}
        for node, values in parameters.items()
    }
    return write_parameters(started, folder / "parameters.yaml")


class LaunchedGraph:
    """Nodes of one launched flight, which end together."""

    def __init__(self, names: Iterable[str] = NODE_NAMES) -> None:
        self._names = frozenset(names)
        self._running = set(self._names)
        self._has_failed = False

    @property
    def has_ended(self) -> bool:
        """True if no node runs any more."""
        return not self._running

    def note_end(self, name: str, exit_code: int, is_stopped: bool) -> str:
        """Note that a node's process has ended.

        Args:
            name: of the node, without namespace.
            exit_code: of its process.
            is_stopped: whether the whole launch is being shut down.

        Returns:
            Why the flight is not complete, once; empty if it is, or not known yet.
        """
        is_first = self._running == self._names
        self._running.discard(name)
        failure = ""
        if exit_code:
            failure = f"{name} ended with exit code {exit_code}"
        elif is_first and is_stopped:
            failure = "stopped before the flight's end"
        elif is_first and name != PLANT:
            failure = f"{name} ended before the flight did"
        if self._has_failed or not failure:
            return ""
        self._has_failed = True
        return failure


def report_failure(context: Any, failure: str) -> None:
    """Log a failure in a launch, which goes on, and ends with exit code 1.

    ``context``: launch's, whose event loop counts errors; an exception would shut all down.
    """
    context.asyncio_loop.call_exception_handler({"message": f"error: {failure}"})
