"""Monitor of a flight through its public topics."""

from __future__ import annotations

import math
from contextlib import suppress
from itertools import islice
from typing import Any, NamedTuple

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py import topics
from space_robot_msgs_py.config.validation import relative
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.wire.definitions import decode
from space_robot_msgs_py.wire.messages import TELEMETRY_ROWS
from space_robot_msgs_py.wire.telemetry import TelemetryCodec

from .node_names import PLANT
from .node_services import TemporaryNode

MONITOR = "flight_monitor"
"""Name of the node with which a flight is followed."""
MOST_AT_ONCE = 1_000
"""Messages of a topic read in one poll, in case of a flood."""


class Event(NamedTuple):
    """Something that happened in a flight."""

    simulated_s: float
    """Time of its tick, if the node reports one; else time of reception."""
    node: str
    what: str

    def __str__(self) -> str:
        return f"{self.simulated_s:8.3f} s  {self.node}: {self.what}"


class Monitor:
    """Simulated time from /clock, errors from telemetry, the nodes' modes from /diagnostics."""

    def __init__(
        self, domain: int, namespace: str = topics.ROOT, name: str = MONITOR, period: float = 0.0
    ) -> None:
        """Join; ``period``: of ticks, s (0: unknown, events have the time of their reception)."""
        from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription

        self._visitor = TemporaryNode(name, domain, namespace)
        self._namespace, self._period = namespace, period
        self.node = self._visitor.node
        group = PolledCallbackGroup()
        self._heard = (
            (RawSubscription(self.node, topics.CLOCK, group, depth=1), self._read_clock),
            (RawSubscription(self.node, topics.TELEMETRY, group, depth=1), self._read_telemetry),
            (RawSubscription(self.node, topics.DIAGNOSTICS, group), self._read_diagnostics),
        )
        self.simulated_s = 0.0
        self.has_begun = False
        """True if the plant has sent a tick."""
        self.error: Array | None = None
        """(n+3,) current tracking error as the law sees it: -eps_e, then joints, rad or m."""
        self.modes: dict[str, str] = {}
        """The mode of each node, by its name in the namespace."""
        self._levels: dict[str, int] = {}
        self.values: dict[str, dict[str, str]] = {}
        """The values that each node reported last."""
        self.silence: dict[str, int] = {}
        """How often the plant has reported since each node's last report."""

    def poll(self) -> list[Event]:
        """Take the newest messages; return the nodes' relevant changes of mode."""
        events: list[Event] = []
        for subscription, read in self._heard:
            for data in islice(iter(subscription.take, None), MOST_AT_ONCE):
                with suppress(MessageError):  # somebody else's, not fit to be shown
                    events += read(data)
        return events

    def _read_clock(self, data: bytes) -> list[Event]:
        from space_robot_msgs_py.wire.cdr import header_stamp_ns

        self.simulated_s, self.has_begun = header_stamp_ns(data) / 1e9, True
        return []

    def _read_telemetry(self, data: bytes) -> list[Event]:
        _, rows = TelemetryCodec.decode(data)
        if rows.ndim == 2 and len(rows) == len(TELEMETRY_ROWS) and rows.shape[1] > 3:
            self.error = rows[TELEMETRY_ROWS.index("e")]
        return []

    def _read_diagnostics(self, data: bytes) -> list[Event]:
        statuses = decode(data, topics.DIAGNOSTICS.type).status
        return [event for status in statuses for event in self._take_status(status)]

    def _take_status(self, status: Any) -> list[Event]:
        mode = status.message
        if not (name := relative(f"/{status.name}", self._namespace)):
            return []
        if name == PLANT:
            self.silence = {node: reports + 1 for node, reports in self.silence.items()}
        self.silence[name] = 0
        self.values[name] = {item.key: item.value for item in status.values}
        before, self.modes[name] = self.modes.get(name), mode
        level_before, self._levels[name] = self._levels.get(name, 0), status.level
        is_news = before != mode and (status.level > 0 or level_before > 0)
        return [Event(self._event_time(name), name, mode)] if is_news else []

    def _event_time(self, name: str) -> float:
        tick = self.reported_tick(name)
        return tick * self._period if tick > 0 and self._period else self.simulated_s

    def reported_tick(self, name: str) -> int:
        """Return the tick that a node reported last; 0 if none."""
        with suppress(ValueError):  # somebody else's words
            return int(self.values.get(name, {}).get("tick", 0))
        return 0

    @property
    def errors(self) -> tuple[float, float] | None:
        """Current angle of the attitude's error, deg, and the largest joint error (rad or m)."""
        if self.error is None:
            return None
        eps = min(1.0, math.hypot(*self.error[:3]))
        return math.degrees(2.0 * math.asin(eps)), float(abs(self.error[3:]).max())

    @property
    def complaints(self) -> dict[str, str]:
        """Modes of nodes with problems, by name."""
        return {name: mode for name, mode in self.modes.items() if self._levels[name] > 0}

    def close(self) -> None:
        """Leave the graph."""
        self._visitor.leave()
