"""Counting what arrived and what is missing, from the ticks in the messages themselves.

Nothing else in a bag tells a lost message: header stamps are ticks, so gaps are losses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .. import topics
from ..cdr import header_stamp_ns
from ..codecs import TelemetryCodec
from ..samples import Timebase


def message_tick(topic: topics.Topic, data: bytes, timebase: Timebase) -> int:
    """The tick a serialized message is stamped with (of a chunk: its first)."""
    if topic is topics.TELEMETRY:
        return TelemetryCodec.decode(data)[0]
    return timebase.tick(header_stamp_ns(data))


@dataclass(slots=True)
class Coverage:
    """Ticks of one topic's messages, in rising order."""

    topic: topics.Topic
    received: int = 0
    repeated: int = 0
    first: int = 0
    last: int = -1
    unit: int = 0
    """Ticks from one message to the next: the smallest step seen."""

    def take(self, tick: int) -> bool:
        """Count a message; False if one of this tick (or a later one) has come already."""
        if self.received == 0:
            self.first = tick
        elif tick <= self.last:
            self.repeated += 1
            return False
        else:
            step = tick - self.last
            self.unit = min(self.unit, step) if self.unit else step
        self.last = tick
        self.received += 1
        return True

    def missing(self, last_tick: int) -> int:
        """Messages that were sent but are not here, for a flight from tick 0 to ``last_tick``."""
        if self.topic.per_tick:
            return last_tick + 1 - self.received
        if self.received == 0:
            return 1 if last_tick >= 0 else 0
        return (self.last - self.first) // (self.unit or 1) + 1 - self.received


def lost_messages(
    coverages: Mapping[str, Coverage], realtime: bool = False, finished: bool = True
) -> dict[str, int]:
    """Missing messages a topic; the flight's length is that of the longest per-tick topic.

    By the wall clock (``realtime``) a tick without a command (and its telemetry) is one the
    controller did not answer (`unanswered_ticks`), not a lost message. Of a bag that was not
    ``finished`` each topic counts up to its own last message: nobody knows what came after.
    """
    lost = {
        name: coverage.missing(_last_tick(coverages) if finished else coverage.last)
        for name, coverage in coverages.items()
    }
    if realtime:
        lost |= dict.fromkeys({topics.COMMAND.name, topics.TELEMETRY.name} & lost.keys(), 0)
    return lost


def unanswered_ticks(coverages: Mapping[str, Coverage], finished: bool = True) -> int:
    """Ticks without a command."""
    command = coverages[topics.COMMAND.name]
    return command.missing(_last_tick(coverages) if finished else command.last)


def _last_tick(coverages: Mapping[str, Coverage]) -> int:
    return max((c.last for c in coverages.values() if c.topic.per_tick), default=-1)
