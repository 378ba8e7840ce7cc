"""One flight of the four processes for a benchmark, watched from outside."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil
from numpy.typing import NDArray

from space_robot.flight.graph.domain import ros_domain
from space_robot.flight.graph.node_server import Program
from space_robot.flight.graph.orchestrator import flight_parameters, require_ros
from space_robot.flight.graph.processes import Command, Graph, node_environment, ros_arguments
from space_robot.flight.plan import Flight
from space_robot.processes.node_modules import MODULES
from space_robot_msgs_py.bag.accounts import noted_accounts
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.ros.run_module import module_command

TESTS = Path(__file__).resolve().parents[1]
WATCH_S = 0.2
WARM_UP_TICKS = 500
TIMEOUT_S = 1800.0

Times = dict[str, NDArray[np.int64]]


@dataclass
class NodeUse:
    """What a node's process took, sampled while the plant flew."""

    memory_mb: list[float] = field(default_factory=list)
    """Resident set."""
    cpu_s: list[float] = field(default_factory=list)
    """Processor time of all its threads since its start."""
    at_s: list[float] = field(default_factory=list)
    """When."""

    @property
    def cores(self) -> float:
        """Cores busy on average."""
        if len(self.at_s) < 2:
            return 0.0
        return (self.cpu_s[-1] - self.cpu_s[0]) / (self.at_s[-1] - self.at_s[0])


@dataclass
class GraphRun:
    """What was seen of one flight."""

    plant: Times
    controller: Times
    lost: dict[str, int]
    """Messages missing in the bag, by topic."""
    received: int
    """Messages in the bag."""
    use: dict[str, NodeUse]
    """By node."""

    @property
    def ticks_per_s(self) -> float:
        """Mean rate after the warm-up."""
        starts = self.plant["step plant start"][WARM_UP_TICKS:]
        return float((len(starts) - 1) / (starts[-1] - starts[0]) * 1e9)


def fly_graph(flight: Flight, empty: bool = False, timed: bool = True) -> GraphRun:
    """Fly on plant and controller, mission and recorder, each a process.

    ``timed`` ones are those of `nodes`, which keep every duration in memory. They are forked, as
    those of `space-robot fly`; untimed ones are started anew, so that their memory is their own.

    Raises:
        FlightError: a node ended before the flight did, or the flight takes for ever.
    """
    require_ros()
    with tempfile.TemporaryDirectory(prefix="space_robot_bench_") as folder, ros_domain() as domain:
        bag = Path(folder) / "bag"
        parameters = flight_parameters(flight, bag)
        work = "empty" if empty else "full"
        files = {node: Path(folder) / f"{node}.npz" for node in ("plant", "controller")}
        commands: dict[str, Command] = {}
        for node, module in MODULES.items():
            arguments = ros_arguments(parameters[node])
            if not timed:
                commands[node] = module_command(module, *arguments)
            elif node in files:
                watched = [node, work, str(files[node]), *arguments]
                commands[node] = Program("benchmarks.nodes", watched)
            else:
                commands[node] = Program(module, arguments)
        with Graph(commands, _environment(domain)) as graph:
            use = _watch(graph)
        accounts = noted_accounts(open_bag(bag).custom_data())
        return GraphRun(
            _times(files["plant"]) if timed else {},
            _times(files["controller"]) if timed else {},
            {name: counts.missing for name, counts in accounts.items() if counts.missing},
            sum(counts.received for counts in accounts.values()),
            use,
        )


def naive_ticks_per_s(ticks: int) -> float:
    """Rate of the two nodes of `naive`, ticks/s.

    Raises:
        FlightError: one of them ended before.
    """
    with tempfile.TemporaryDirectory(prefix="space_robot_bench_") as folder, ros_domain() as domain:
        file = Path(folder) / "rate"
        commands = {
            node: Program("benchmarks.naive", [node, str(file), str(ticks)])
            for node in ("controller", "plant")
        }
        with Graph(commands, _environment(domain)) as graph:
            _watch(graph)
        return float(file.read_text("utf-8"))


def _environment(domain: int) -> dict[str, str]:
    """What a node's process is started with; it finds the modules of the benchmarks."""
    environment = node_environment(domain)
    paths = (str(TESTS), environment.get("PYTHONPATH", ""))
    return {**environment, "PYTHONPATH": os.pathsep.join(filter(None, paths))}


def _watch(graph: Graph) -> dict[str, NodeUse]:
    """Sample every node until the plant has flown."""
    processes = {name: psutil.Process(node.pid) for name, node in graph.nodes.items()}
    use = {name: NodeUse() for name in processes}
    until = time.monotonic() + TIMEOUT_S
    while not graph.check():
        if time.monotonic() > until:
            raise FlightError(f"the graph has not flown its mission within {TIMEOUT_S:.0f} s")
        time.sleep(WATCH_S)
        for name, process in processes.items():
            with _gone_is_fine(), process.oneshot():
                times = process.cpu_times()
                use[name].memory_mb.append(process.memory_info().rss / 1e6)
                use[name].cpu_s.append(times.user + times.system)
                use[name].at_s.append(time.monotonic())
    return use


@contextmanager
def _gone_is_fine() -> Iterator[None]:
    try:
        yield
    except psutil.NoSuchProcess:
        return


def _times(file: Path) -> Times:
    with np.load(file) as arrays:
        return {name: arrays[name] for name in arrays.files}
