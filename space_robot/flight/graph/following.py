"""Follow a graph of nodes through a flight: activate, monitor, inject faults, show, stop."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from space_robot_msgs_py.errors import FlightError
from space_robot_sim.faults.grammar import Fault
from space_robot_sim.plant.pacing import PAUSED

from ...console.progress import FlightProgress, flight_progress
from ...processes.interruption import exit_code
from ...scenario.faults import FAULTED_NODES, KILLS
from ..plan import Flight
from .domain import refuse_publishers
from .monitor import Event, Monitor
from .node_names import PLANT, OwnNodes, published_topics, started_nodes, wait_for
from .node_services import change_state
from .processes import Graph, NodeProcess, node_command

POLL_S = 0.1
INJECTING_POLL_S = 0.01
STALL_TIMEOUT_S = 60.0
LISTENER_TIMEOUT_S = 5.0
"""Longest wait of a restarted controller for its listeners, s."""
HUNG_REPORTS = 5
"""Reports of the plant, one a second, without one of a controller that then counts as hung."""
MOST_RESTARTS = 20
MISSION_FAULTS = frozenset({"kill_mission", "stop_mission"})
NOT_USED = "rejected: reference: "
"""Beginning of the counts of references that a node could not use."""


def degradation(
    nodes: Mapping[str, Mapping[str, str]], fault_kinds: frozenset[str], realtime: bool
) -> tuple[list[str], list[str]]:
    """Return why a flight differs from the plan, and anomalies without consequences, as texts.

    A reference that was held is another motion than the mission's. In lockstep nothing but a fault
    of the mission can bring that about; by the wall clock any delay can.
    """
    failures: list[str] = []
    warnings: list[str] = []
    for node, values in nodes.items():
        held = int(values.get("references_held", 0))
        if held and not fault_kinds & MISSION_FAULTS:
            text = f"{node} held the reference for {held} ticks, for the mission's did not come"
            (warnings if realtime else failures).append(text)
        warnings += [
            f"{node} {key}: {count} messages"
            for key, count in values.items()
            if key.startswith(NOT_USED)
        ]
    return failures, warnings


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
        follower = _Follower(graph, flight, parameters["controller"], monitor, folder, stopped)
        with flight_progress(follower.total_s, flight.controller_name) as show:
            follower.bring_up(show, is_empty)
            follower.until_complete(show)
        return follower.end()
    finally:
        monitor.close()


class _Follower:
    """Keeps a flight going where possible.

    Without its plant a flight is over. A controller is restarted if that is wanted. Without
    recorder or mission the flight goes on: the one costs the bag's end, without the other the last
    point of the reference is held.
    """

    def __init__(
        self,
        graph: Graph,
        flight: Flight,
        controller_parameters: Mapping[str, Any],
        monitor: Monitor,
        folder: Path,
        stopped: list[int],
    ) -> None:
        slides = flight.robot.is_prismatic[: flight.robot.n]
        self._unit = "m" if slides.all() else "rad or m" if slides.any() else "rad"
        self.total_s = flight.ticks * flight.period
        self._last_clock_s = self.total_s - flight.plant_settings.clock_decimation * flight.period
        self._graph, self._monitor, self._stopped = graph, monitor, stopped
        self._flight, self._folder = flight, folder
        self._controller_parameters = controller_parameters
        self._options = options = flight.scenario.options
        self._names = started_nodes(options.without)
        self._joined_at = time.monotonic()
        self._own = OwnNodes(monitor.node, options.without, options.join_timeout)
        faults = flight.scenario.process_faults
        self._injector = Injector(faults, graph)
        self._fault_kinds = frozenset(fault.kind.name for fault in faults)
        self._planned = frozenset(FAULTED_NODES[fault.kind] for fault in faults)
        self._gone: set[str] = set()
        self._has_flown = False
        self._restarts = 0
        self._failures: list[str] = []
        self._events: list[Event] = []
        self._begun_at = 0.0
        """Time of the first tick; 0 before."""
        self._last_s, self._moved_at = 0.0, time.monotonic()

    def bring_up(self, show: FlightProgress, is_empty: bool) -> None:
        show(0.0, "configuring the nodes")
        self._change(self._names, "configure")
        if not is_empty:
            foreign = published_topics(self._options.without)
            node = self._monitor.node
            refuse_publishers(node, self._joined_at, self._names, foreign, self._check_start)
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

    def _check_start(self) -> None:
        self._graph.check()
        if self._stopped:
            raise InterruptedFlightError("stopped before the flight began", self._stopped[0])

    def until_complete(self, show: FlightProgress) -> None:
        monitor, injector = self._monitor, self._injector
        while self._graph.leader.exit_code != 0 and not self._has_flown:
            if self._stopped:
                raise InterruptedFlightError(
                    f"stopped at {monitor.simulated_s:.2f} s", self._stopped[0]
                )
            time.sleep(INJECTING_POLL_S if injector.is_busy else POLL_S)
            news = [*monitor.poll(), *injector.poll(monitor.simulated_s)]
            news += self._check_processes()
            if arrived := self._own.arrived():
                show.say(arrived)
            self._show_progress(show)
            self._keep(news, show)
        self._keep(monitor.poll(), show)
        show(self.total_s, "")

    def _keep(self, news: Sequence[Event], show: FlightProgress | None = None) -> None:
        for event in news:
            if event.simulated_s < self._last_clock_s:  # later ends are normal
                self._events.append(event)
                if show:
                    show.say(str(event))

    def end(self) -> dict[str, Any]:
        self._graph.stop()
        recorder = self._graph.host_process("recorder")
        if recorder.exit_code != 0 and "recorder" not in self._gone:
            self._failures.append(recorder.output_tail().splitlines()[-1].strip())
        if self._stopped:
            raise InterruptedFlightError("stopped when the flight was complete", self._stopped[0])
        self._keep(self._monitor.poll())  # the nodes' last reports
        realtime = self._flight.plant_settings.realtime
        failures, warnings = degradation(self._monitor.values, self._fault_kinds, realtime)
        return {
            "events": [
                event._asdict() for event in sorted(self._events, key=lambda e: e.simulated_s)
            ],
            "nodes": self._monitor.values,
            "restarts": self._restarts,
            "failures": [*self._failures, *failures],
            "warnings": warnings,
        }

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

    def _check_processes(self) -> list[Event]:
        events = []
        simulated_s, leader = self._monitor.simulated_s, self._graph.leader
        for name, node in list(self._graph.nodes.items()):
            silence = self._monitor.silence.get(f"{name}_node", 0)
            may_restart = name == "controller" and self._options.restart_controller
            hangs = may_restart and silence >= HUNG_REPORTS
            if (node.exit_code is None and not hangs) or name in self._gone:
                continue
            if node is leader:
                if node.exit_code != 0:
                    self._lose_leader(node)
                continue
            ended = "does not answer" if hangs else node.exit_summary()
            events.append(Event(simulated_s, f"{name}_node", ended))
            if name == "controller":
                self._lose_controller(node)
            else:
                self._gone.add(name)
                if name == "recorder" or name not in self._planned:
                    self._failures.append(f"{ended} at {simulated_s:.2f} s")
        return events

    def _lose_leader(self, leader: NodeProcess) -> None:
        self._monitor.poll()
        is_recorders = leader is self._graph.host_process("recorder")  # which has failed, then
        last_tick = self._flight.ticks
        self._has_flown = is_recorders and self._monitor.reported_tick(PLANT) >= last_tick
        if not self._has_flown:
            raise leader.early_end()

    def _lose_controller(self, node: NodeProcess) -> None:
        if self._options.restart_controller and self._restarts < MOST_RESTARTS:
            self._restarts += 1
            nodes = self._graph.nodes.items()
            absent = [f"{name}_node" for name, node in nodes if node.exit_code is not None]
            # it must discover the recorder before it begins, else the bag lacks its first answers;
            # the wait is short, since a recorder may be stopped
            listeners = wait_for("controller", absent)
            again = {"wait_for": listeners, "listener_timeout": LISTENER_TIMEOUT_S}
            parameters = {**self._controller_parameters, **again}
            command = node_command("controller", parameters, self._options.namespace, self._folder)
            self._graph.restart("controller", command)
            self._monitor.silence.pop("controller_node", None)  # until it speaks again
        elif "controller" in self._planned:
            self._gone.add("controller")
        else:
            raise node.early_end()


def _remark(
    errors: tuple[float, float] | None, simulated_s: float, wall_s: float, unit: str
) -> str:
    speed = f"{simulated_s / wall_s:.1f}x real time, " if wall_s > 0.5 else ""
    if errors is None:
        return speed
    # the law of a free base sees no error of its attitude
    attitude = f"attitude {errors[0]:.1e} deg, " if errors[0] else ""
    return f"{speed}errors: {attitude}joints {errors[1]:.1e} {unit}"


class Injector:
    """Sender of the signals of a flight's faults at their times."""

    def __init__(self, faults: Sequence[Fault], graph: Graph) -> None:
        self._waiting = sorted(faults, key=lambda fault: fault.start_s)
        self._graph = graph
        self._stopped: dict[str, float] = {}

    @property
    def is_busy(self) -> bool:
        """True if any fault is pending."""
        return bool(self._waiting or self._stopped)

    def poll(self, simulated_s: float) -> list[Event]:
        """Inject the faults due at a simulated time."""
        events = []
        while self._waiting and self._waiting[0].start_s <= simulated_s:
            events.append(self._inject(self._waiting.pop(0), simulated_s))
        for node, until in list(self._stopped.items()):
            if time.monotonic() >= until:
                del self._stopped[node]
                self._graph.nodes[node].signal(signal.SIGCONT)
                events.append(Event(simulated_s, f"{node}_node", "goes on (SIGCONT)"))
        return events

    def _inject(self, fault: Fault, simulated_s: float) -> Event:
        node = FAULTED_NODES[fault.kind]
        if fault.kind == KILLS[node]:
            self._graph.nodes[node].signal(signal.SIGKILL)
            return Event(simulated_s, f"{node}_node", "killed (SIGKILL)")
        self._graph.nodes[node].signal(signal.SIGSTOP)
        if math.isfinite(fault.value):
            self._stopped[node] = time.monotonic() + fault.value
        return Event(simulated_s, f"{node}_node", "stopped (SIGSTOP)")
