"""Follow a graph of nodes through a flight: activate, monitor, show, stop."""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from space_robot_msgs_py.errors import FlightError
from space_robot_sim.plant.pacing import PAUSED

from ...console.progress import FlightProgress, flight_progress
from ...processes.interruption import exit_code
from ...scenario.faults import NODE_OF
from ..plan import Flight
from .domain import refuse_publishers
from .monitor import Event, Monitor
from .node_names import PLANT, OwnNodes, published_topics, started_nodes, wait_for
from .node_services import change_state
from .processes import Command, Graph, node_command
from .watch import Injector, Watch

POLL_S = 0.1
INJECTING_POLL_S = 0.01
STALL_TIMEOUT_S = 60.0
LISTENER_TIMEOUT_S = 5.0
"""Longest wait of a restarted controller for its listeners, s."""


MISSION_FAULTS = frozenset({"kill_mission", "stop_mission"})
NOT_USED = "rejected: reference: "
"""Beginning of the counts of references that a node could not use."""


class Degradation(NamedTuple):
    """Failures and warnings of a flight, as one-line texts."""

    failures: list[str]
    """Reasons why the flight differs from the plan."""
    warnings: list[str]
    """Anomalies without consequences."""


def degradation(
    nodes: Mapping[str, Mapping[str, str]], fault_kinds: frozenset[str], realtime: bool
) -> Degradation:
    """Return the degradations of a flight.

    A reference that was held is another motion than the mission's. In lockstep nothing but a fault
    of the mission can bring that about; by the wall clock any delay can.
    """
    degraded = Degradation([], [])
    for node, values in nodes.items():
        held = int(values.get("references_held", 0))
        if held and not fault_kinds & MISSION_FAULTS:
            text = f"{node} held the reference for {held} ticks, for the mission's did not come"
            (degraded.warnings if realtime else degraded.failures).append(text)
        degraded.warnings.extend(
            f"{node} {key}: {count} messages"
            for key, count in values.items()
            if key.startswith(NOT_USED)
        )
    return degraded


class InterruptedFlightError(FlightError):
    """The user stopped the flight."""

    def __init__(self, text: str, number: int) -> None:
        """``number``: of the signal."""
        super().__init__(text)
        self.number, self.exit_code = number, exit_code(number)


def follow(
    graph: Graph,
    flight: Flight,
    parameters: dict[str, dict[str, Any]],
    domain: int,
    folder: Path,
    stopped: list[int],
    is_empty: bool = False,
) -> dict[str, Any]:
    """Fly on started nodes until the plant ends the flight; return a report."""
    monitor = Monitor(domain, flight.scenario.options.namespace, period=flight.period)
    try:
        follower = _Follower(graph, flight, parameters, monitor, folder, stopped)
        with flight_progress(follower.total_s, flight.controller_name) as show:
            follower.bring_up(show, is_empty)
            follower.until_complete(show)
        return follower.end()
    finally:
        monitor.close()


class _Follower:
    def __init__(
        self,
        graph: Graph,
        flight: Flight,
        parameters: dict[str, dict[str, Any]],
        monitor: Monitor,
        folder: Path,
        stopped: list[int],
    ) -> None:
        slides = flight.robot.is_prismatic[: flight.robot.n]
        self._unit = "m" if slides.all() else "rad or m" if slides.any() else "rad"
        self.total_s = flight.ticks * flight.period
        self._last_clock_s = self.total_s - flight.plant_settings.clock_decimation * flight.period
        self._graph, self._monitor, self._stopped = graph, monitor, stopped
        options = flight.scenario.options
        self._names = started_nodes(options.without)
        self._joined_at = time.monotonic()
        self._topics_of_others = published_topics(options.without)
        self._own = OwnNodes(monitor.node, options.without, options.join_timeout)
        self._fault_kinds = frozenset(fault.kind.name for fault in flight.scenario.process_faults)
        self._realtime = flight.plant_settings.realtime
        self._injector = Injector(flight.scenario.process_faults, graph)
        self._watch = Watch(
            graph,
            monitor,
            planned=frozenset(NODE_OF[fault.kind] for fault in flight.scenario.process_faults),
            restart_command=(
                partial(_restart_command, parameters["controller"], options.namespace, folder)
                if flight.scenario.options.restart_controller
                else None
            ),
            last_tick=flight.ticks,
        )
        self._events: list[Event] = []
        self._begun_at = 0.0
        """Time of the first tick; 0 before."""
        self._last_s, self._moved_at = 0.0, time.monotonic()

    def bring_up(self, show: FlightProgress, is_empty: bool) -> None:
        """Configure all nodes, then activate them, the plant last."""
        show(0.0, "configuring the nodes")
        self._change(self._names, "configure")
        if not is_empty:
            node, of_others = self._monitor.node, self._topics_of_others
            refuse_publishers(node, self._joined_at, self._names, of_others, self._check_start)
        for name in self._names:
            self._change([name], "activate")
        show.say(
            f"configured and active: {', '.join(n.removesuffix('_node') for n in self._names)}"
        )
        if awaited := self._own.awaited:
            show.say(f"waiting for {awaited}")
        show(0.0, "waiting for the nodes")

    def _change(self, names: Sequence[str], transition: str) -> None:
        for name in change_state(self._monitor.node, names, transition, self._check_start):
            output = self._graph.host_process(name.removesuffix("_node")).output_tail()
            raise FlightError(f"{name} refused to {transition}:\n{output}")

    def until_complete(self, show: FlightProgress) -> None:
        """Monitor the flight, inject faults and show progress."""
        monitor, injector = self._monitor, self._injector
        while not self._watch.is_complete:
            if self._stopped:
                raise InterruptedFlightError(
                    f"stopped at {monitor.simulated_s:.2f} s", self._stopped[0]
                )
            time.sleep(INJECTING_POLL_S if injector.is_busy else POLL_S)
            news = [*monitor.poll(), *injector.poll(monitor.simulated_s)]
            news += self._watch.poll(monitor.simulated_s)
            if arrived := self._own.arrived():
                show.say(arrived)
            self._show_progress(show)
            self._keep(news, show)
        self._keep(monitor.poll(), show)
        show(self.total_s, "")

    def _keep(self, news: Sequence[Event], show: FlightProgress | None = None) -> None:
        """Show and keep events before the plant's last clock message; later ends are normal."""
        for event in news:
            if event.simulated_s < self._last_clock_s:
                self._events.append(event)
                if show:
                    show.say(str(event))

    def end(self) -> dict[str, Any]:
        """Stop the other nodes; return a report."""
        self._graph.stop()
        self._watch.check_recorder_exit()
        if self._stopped:
            raise InterruptedFlightError("stopped when the flight was complete", self._stopped[0])
        self._keep(self._monitor.poll())  # the nodes' last reports
        degraded = degradation(self._monitor.values, self._fault_kinds, self._realtime)
        return {
            "events": [
                event._asdict() for event in sorted(self._events, key=lambda e: e.simulated_s)
            ],
            "nodes": self._monitor.values,
            "restarts": self._watch.restarts,
            "failures": [*self._watch.failures, *degraded.failures],
            "warnings": degraded.warnings,
        }

    def _check_start(self) -> None:
        self._graph.check()
        if self._stopped:
            raise InterruptedFlightError("stopped before the flight began", self._stopped[0])

    def _show_progress(self, show: FlightProgress) -> None:
        monitor, now = self._monitor, time.monotonic()
        is_paused = monitor.modes.get(PLANT) == PAUSED
        if monitor.simulated_s != self._last_s or (not self._begun_at and monitor.has_begun):
            self._begun_at = self._begun_at or now
            self._last_s, self._moved_at = monitor.simulated_s, now
            wall_s = now - self._begun_at
            show(self._last_s, _remark(monitor.errors, self._last_s, wall_s, self._unit))
        elif is_paused:
            self._moved_at = now
            show(self._last_s, PAUSED)
        elif now - self._moved_at > STALL_TIMEOUT_S + (
            0.0 if self._last_s else self._own.timeout_s
        ):
            output = "\n".join(f"{n}:\n{p.output_tail()}" for n, p in self._graph.nodes.items())
            why = "".join(f"{node}: {mode}\n" for node, mode in monitor.complaints.items())
            raise FlightError(
                f"no progress for {STALL_TIMEOUT_S:.0f} s at {self._last_s:.2f} s:\n{why}{output}"
            )


def _remark(
    errors: tuple[float, float] | None, simulated_s: float, wall_s: float, unit: str
) -> str:
    speed = f"{simulated_s / wall_s:.1f}x real time, " if wall_s > 0.5 else ""
    if errors is None:
        return speed
    # the law of a free base sees no error of its attitude
    of_base = f"attitude {errors[0]:.1e} deg, " if errors[0] else ""
    return f"{speed}errors: {of_base}joints {errors[1]:.1e} {unit}"


def _restart_command(
    parameters: Mapping[str, Any], namespace: str, folder: Path, absent: Collection[str]
) -> Command:
    """Return the command to restart a controller while some nodes are ``absent``.

    The recorder must discover it before it begins, else its first answers are missing in the
    bag. The wait is short, since a recorder may be stopped.
    """
    listeners = wait_for("controller", absent)
    again = {"wait_for": listeners, "listener_timeout": LISTENER_TIMEOUT_S}
    return node_command("controller", {**parameters, **again}, namespace, folder)
