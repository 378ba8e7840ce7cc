"""Faults caused by the orchestrator: nodes killed, or stopped for a while."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Sequence

from space_robot_sim.faults.grammar import Fault

from ...scenario.faults import KILLS, NODE_OF
from .monitor import Event
from .processes import Graph


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
