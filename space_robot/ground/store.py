"""Store of decoded telemetry: the curve of each parameter, and the events of a flight."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterable
from typing import Any

from .decoder import EVENT_PACKET, Packet

MOST_VALUES = 1_000_000
"""Values kept of a parameter; the oldest go first."""
MOST_SHOWN = 4_000
"""Values of a parameter in an answer; of more, the least and the largest of each interval."""
SEVERITIES = {"nominal": "information", "holding": "warning", "safe": "critical"}
"""Of a mode that was entered."""


class TelemetryStore:
    """Values by parameter in the order of their times, s."""

    def __init__(self, timeline: Iterable[tuple[float, str]] = ()) -> None:
        """``timeline``: planned events, as time, s, and text."""
        self._timeline = sorted(timeline)
        self.clear()

    def clear(self) -> None:
        """Forget everything but the planned events: another flight begins."""
        self._times: dict[str, list[float]] = defaultdict(list)
        self._values: dict[str, list[float | str]] = defaultdict(list)
        self._planned = list(self._timeline)
        self.events: list[dict[str, Any]] = []
        """Events by time: as reported, and planned ones whose time has come."""
        self.newest_s = 0.0

    def add(self, packet: Packet) -> None:
        """Add the values of a packet."""
        self.newest_s = packet.time_s
        while self._planned and self._planned[0][0] <= packet.time_s:
            time_s, text = self._planned.pop(0)
            self.events.append({"time": time_s, "text": text, "level": "warning"})
        if packet.container == EVENT_PACKET:
            self.events.append(event_of(packet))
            return
        for name, value in packet.values.items():
            times = self._times[name]
            if times and times[-1] >= packet.time_s:  # law and tick are in each structure
                continue
            times.append(packet.time_s)
            self._values[name].append(value)
            if len(times) > MOST_VALUES:
                del times[: MOST_VALUES // 10], self._values[name][: MOST_VALUES // 10]

    def history(self, name: str, start_s: float, end_s: float) -> list[tuple[float, float | str]]:
        """Return times and values of a parameter within an interval; of many, their envelope."""
        times, values = self._times.get(name, []), self._values.get(name, [])
        rows = range(bisect_left(times, start_s), bisect_right(times, end_s))
        if len(rows) <= MOST_SHOWN:
            return [(times[k], values[k]) for k in rows]
        size, shown = -(-2 * len(rows) // MOST_SHOWN), []
        for first in range(rows.start, rows.stop, size):
            interval = range(first, min(first + size, rows.stop))
            ends = {min(interval, key=values.__getitem__), max(interval, key=values.__getitem__)}
            shown += [(times[k], values[k]) for k in sorted(ends)]
        return shown


def event_of(packet: Packet) -> dict[str, Any]:
    """Return an event packet as a row of the event table."""
    value = str(packet.values.get("law", packet.values.get("mode", "")))
    text = f"{str(packet.values['event']).replace('_', ' ')}: {value}"
    return {"time": packet.time_s, "text": text, "level": SEVERITIES.get(value, "information")}
