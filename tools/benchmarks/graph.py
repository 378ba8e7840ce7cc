"""The graph of real nodes: how fast in lockstep, how punctual by the wall clock."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from graph_nodes import PARTS, WARM_UP_TICKS
from mcap.reader import make_reader
from measuring import Row, Run
from plant import flight_of

from space_robot.analysis import analyze
from space_robot.flight.graph import orchestrator
from space_robot.flight.graph.domain import ros_domain
from space_robot.flight.graph.node_server import Program
from space_robot.flight.graph.processes import Command, Graph, node_environment, ros_arguments
from space_robot.processes import MODULES
from space_robot_msgs_py import topics

LOCKSTEP_S, COMPOSED_CLOCK_S, CLOCK_S = 10.0, 30.0, 60.0
FIFO_PRIORITY = 50
WATCH_S = 0.2
HERE = {"PYTHONPATH": str(Path(__file__).parent)}
"""Where nodes find `graph_nodes`."""


class Flown(NamedTuple):
    """What was seen of one flight."""

    ticks_per_s: float
    """Mean rate after the warm-up."""
    answered: float
    """Share of ticks whose own command was applied, %."""


def _fly(**plan: Any) -> Flown:
    """Fly the graph."""
    flight = flight_of(**plan)
    with TemporaryDirectory(prefix="space_robot_bench_") as folder:
        bag, name = Path(folder) / "bag", topics.JOINT_STATES.full_name
        missed = orchestrator.fly(flight, bag, analyze)["metrics"]
        with (bag / "bag_0.mcap").open("rb") as stream:
            messages = make_reader(stream).iter_messages([name])
            sent = [message.publish_time for _, _, message in messages][WARM_UP_TICKS:]
    late = missed["commands.unanswered"] + missed["commands.differing"]
    rate = 1e9 * (len(sent) - 1) / (sent[-1] - sent[0])
    return Flown(rate, 100.0 * (1.0 - late / flight.ticks))


def _rates(name: str, flown: list[Flown], beside: str = "", others: tuple[float, ...] = ()) -> Row:
    rates = tuple(each.ticks_per_s for each in flown)
    return Row(name, "ticks/s", rates, beside, others, is_rate=True)


def graph(run: Run) -> Iterator[Row]:
    """Measure the four processes in lockstep, beside two nodes written the usual way.

    Then the mean time of a tick and of the calls in it; the rest is transport and waiting.
    """
    flown, naive, calls = [], [], list[dict[str, float]]()
    for k in range(count := run.batches(5)):
        run.progress(f"the graph in lockstep, {k + 1} of {count}, and naive nodes")
        with TemporaryDirectory(prefix="space_robot_bench_") as folder:
            timed = patch.object(orchestrator, "node_command", _timed_command(Path(folder)))
            with timed, patch.dict(os.environ, HERE):
                flown.append(_fly(duration=0.5 if run.short else LOCKSTEP_S))
            calls.append({})
            for node in PARTS:
                for name, times in np.load(Path(folder) / f"{node}.npz").items():
                    calls[-1][f"{node}: {name}"] = float(times[WARM_UP_TICKS:].mean()) / 1e3
        naive.append(_naive_ticks_per_s(500 if run.short else 4000))
    yield _rates("four processes", flown, "two naive nodes", tuple(naive))
    ticks = [1e6 / each.ticks_per_s for each in flown]
    yield Row("a tick", "us", tuple(ticks))
    for name in calls[0]:
        yield Row(name, "us", tuple(each[name] for each in calls))
    rest = tuple(tick - sum(each.values()) for tick, each in zip(ticks, calls, strict=True))
    yield Row("transport, waking, waiting", "us", rest)


def _timed_command(folder: Path) -> Any:
    """Return what `orchestrator.fly` asks for a node's command: plant and controller are timed."""

    def command(node: str, parameters: Mapping[str, Any], namespace: str, scratch: Path) -> Command:
        arguments = ros_arguments({node: parameters}, namespace, scratch / f"{node}.yaml")
        if node not in PARTS:
            return Program(MODULES[node], arguments)
        return Program("graph_nodes", [node, str(folder / f"{node}.npz"), *arguments])

    return command


def _naive_ticks_per_s(ticks: int) -> float:
    with TemporaryDirectory(prefix="space_robot_bench_") as folder, ros_domain() as domain:
        file = Path(folder) / "rate"
        commands = {
            node: Program("graph_nodes", [f"naive {node}", str(file), str(ticks)])
            for node in ("controller", "plant")
        }
        with Graph(commands, {**node_environment(domain), **HERE}) as nodes:
            while not nodes.check():
                time.sleep(WATCH_S)
        return float(file.read_text("utf-8"))


def composed(run: Run) -> Iterator[Row]:
    """Measure one process: in lockstep beside four processes, and by the wall clock."""
    lockstep, seconds = (0.5, 1.0) if run.short else (LOCKSTEP_S, COMPOSED_CLOCK_S)
    one, four, by_clock = [], [], []
    for k in range(count := run.batches(5)):
        run.progress(f"one process and four, then one by the wall clock, {k + 1} of {count}")
        one.append(_fly(duration=lockstep, composed=True))
        four.append(_fly(duration=lockstep))
        by_clock.append(_fly(duration=seconds, composed=True, realtime=True))
    rates = tuple(each.ticks_per_s for each in four)
    yield _rates("one process", one, "four processes", rates)
    yield _answered("one process, by the wall clock", by_clock)


def clock(run: Run) -> Iterator[Row]:
    """Measure four processes by the wall clock, also under SCHED_FIFO where it is granted."""
    seconds = 1.0 if run.short else CLOCK_S
    flown: dict[str, list[Flown]] = {"four processes": [], "four processes, SCHED_FIFO": []}
    for k in range(count := run.batches(3)):
        for (name, flights), priority in zip(flown.items(), (0, FIFO_PRIORITY), strict=True):
            run.progress(f"{seconds:g} s by the wall clock, {name}, {k + 1} of {count}")
            flights.append(_fly(duration=seconds, realtime=True, fifo_priority=priority))
    for name, flights in flown.items():
        yield _answered(name, flights)


def _answered(name: str, flown: list[Flown]) -> Row:
    answered = tuple(each.answered for each in flown)
    return Row(f"{name}: ticks answered by their end", "%", answered, is_rate=True)
