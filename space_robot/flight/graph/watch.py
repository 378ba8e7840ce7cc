"""Supervision of a flight's processes: faults that stop them, reactions when one ends or hangs."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Collection, Sequence

from space_robot_sim.faults.grammar import Fault

from ...scenario.faults import KILLS, NODE_OF
from .monitor import Event, Monitor
from .node_names import PLANT
from .processes import Command, Graph, NodeProcess

HUNG_S = 2.0
"""Silence after which a controller counts as hung; diagnostics arrive every second."""
MOST_RESTARTS = 20


class Watch:
    """Supervisor that keeps a flight going where possible.

    Without its plant a flight is over. A controller is restarted if that is wanted. Without
    recorder or mission the flight goes on: the one costs the bag's end, without the other the last
    point of the reference is held.
    """

    def __init__(
        self,
        graph: Graph,
        monitor: Monitor,
        planned: frozenset[str],
        restart_command: Callable[[Collection[str]], Command] | None,
        last_tick: int,
    ) -> None:
        """Watch a graph."""
        self._graph, self._monitor, self._last_tick = graph, monitor, last_tick
        self._planned, self._restart_command = planned, restart_command
        self._gone: set[str] = set()
        self._has_flown = False
        self.restarts = 0
        self.failures: list[str] = []
        """Reasons why the flight is not whole."""

    def poll(self, simulated_s: float) -> list[Event]:
        """Check all processes and react.

        Raises:
            FlightError: the flight cannot go on.
        """
        events = []
        leader = self._graph.leader
        for name, node in list(self._graph.nodes.items()):
            hangs = name == "controller" and self._restart_command is not None and self._hangs(name)
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
                    self.failures.append(f"{ended} at {simulated_s:.2f} s")
        return events

    def check_recorder_exit(self) -> None:
        """Check, after all nodes have stopped, that the recorder kept everything."""
        recorder = self._graph.host_process("recorder")
        if recorder.exit_code != 0 and "recorder" not in self._gone:
            self.failures.append(recorder.output_tail().splitlines()[-1].strip())

    @property
    def is_complete(self) -> bool:
        """True if the plant has completed the flight."""
        return self._graph.leader.exit_code == 0 or self._has_flown

    def _hangs(self, name: str) -> bool:
        heard_at = self._monitor.heard_at.get(f"{name}_node")
        return heard_at is not None and time.monotonic() - heard_at > HUNG_S

    def _lose_leader(self, leader: NodeProcess) -> None:
        """End the flight; if the plant has flown to its end it was the recorder that failed."""
        self._monitor.poll()
        is_recorders = leader is self._graph.host_process("recorder")
        self._has_flown = is_recorders and self._monitor.reported_tick(PLANT) >= self._last_tick
        if not self._has_flown:
            raise leader.early_end()

    def _lose_controller(self, node: NodeProcess) -> None:
        if self._restart_command is not None and self.restarts < MOST_RESTARTS:
            self.restarts += 1
            nodes = self._graph.nodes.items()
            ended = [f"{name}_node" for name, node in nodes if node.exit_code is not None]
            self._graph.restart("controller", self._restart_command(ended))
            self._monitor.heard_at.pop("controller_node", None)  # until it speaks again
        elif "controller" in self._planned:
            self._gone.add("controller")
        else:
            raise node.early_end()


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
        node = NODE_OF[fault.kind]
        if fault.kind == KILLS[node]:
            self._graph.nodes[node].signal(signal.SIGKILL)
            return Event(simulated_s, f"{node}_node", "killed (SIGKILL)")
        self._graph.nodes[node].signal(signal.SIGSTOP)
        if math.isfinite(fault.value):
            self._stopped[node] = time.monotonic() + fault.value
        return Event(simulated_s, f"{node}_node", "stopped (SIGSTOP)")
