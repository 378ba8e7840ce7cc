"""Accounting of received and missing messages, from the ticks in their stamps.

Header stamps are ticks, so gaps are lost messages.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from .. import topics
from ..config.text import parse_json
from ..samples import Timebase
from ..wire.cdr import header_stamp_ns
from ..wire.stamp_guard import StampGuard
from ..wire.telemetry import TelemetryCodec

LONGEST_JUMP = 20_000
"""Largest plausible step in ticks between messages: 10 s at 2 kHz."""


ACCOUNTS_KEY = "space_robot.accounting"
"""Of the accounts in a bag's custom data."""
Count = Annotated[int, Field(ge=0, strict=True)]


class Account(BaseModel):
    """Counts of messages of one topic that the recorder has written into a bag."""

    received: Count
    """Distinct messages with a plausible stamp."""
    missing: Count
    """Messages sent, but neither received nor excluded on purpose."""
    repeated: Count = 0
    """Messages excluded because they had arrived before."""
    invalid_stamps: Count = 0
    """Messages in the bag whose stamp is not plausible."""
    while_inactive: Count = 0
    """Messages excluded because the recorder was inactive when they were sent."""


_ACCOUNTS = TypeAdapter(dict[str, Account])


def noted_accounts(noted: Mapping[str, str]) -> dict[str, Account]:
    """Read the accounts in a bag's custom data, by topic; empty if none is valid."""
    try:
        return _ACCOUNTS.validate_python(parse_json(noted.get(ACCOUNTS_KEY, "{}")))
    except (ValueError, ValidationError):
        return {}


def message_tick(topic: topics.Topic, data: bytes, timebase: Timebase) -> int:
    """The tick a serialized message is stamped with (of a chunk: its first; latched: 0)."""
    if topic.has_stamp:
        return timebase.tick(header_stamp_ns(data, topic.stamp_at))
    if topic.is_latched:
        return 0
    return TelemetryCodec.decode(data)[0]


@dataclass(slots=True)
class MessageAccounting:
    """Accounting of the messages of one topic."""

    topic: topics.Topic
    received: int = 0
    repeated: int = 0
    """Number of repeated messages of a tick."""
    invalid_stamps: int = 0
    """Messages whose stamp cannot be right, or cannot be read."""
    first: int = 0
    last: int = -1
    unit: int = 0
    """Ticks from one message to the next: the smallest step seen (0: not known yet)."""
    _guard: StampGuard = field(default_factory=lambda: StampGuard(LONGEST_JUMP))
    _holes: set[int] = field(default_factory=set)
    """Missing ticks, which may still arrive late."""
    _is_resuming: bool = False
    _left_out: int = 0
    """Ticks from the last message before each pause, or from tick 0, to the first after it."""
    _pauses: int = 0
    """The number of pauses that lie between messages."""

    def __post_init__(self) -> None:
        if self.topic.per_tick:
            self.unit = 1

    def take(self, tick: int) -> bool:
        """Count a message; False if one of this tick has come already (events: never)."""
        if self.topic.is_event:
            self.last = max(self.last, tick)
        elif self.received and tick <= self.last:
            if tick not in self._holes:
                self.repeated += 1
                return False
            self._take_late(tick)
        elif not self._guard.passes(tick):
            self.invalid_stamps += 1
            return True
        elif self.received == 0:
            self._pass_over(tick, 1)
            self.first = self.last = tick
        else:
            step = tick - self.last
            self._pass_over(tick, self.unit)
            self._note_step(step)
            self.last = tick
        self.received += 1
        return True

    def take_all(self, ticks: NDArray[np.int64]) -> NDArray[np.bool_]:
        """`take` of many, in their order; those that come as usual are counted at once."""
        is_usual = self.unit and np.all(np.diff(ticks, prepend=self.last) == self.unit)
        if not is_usual or self.topic.is_event or self._is_resuming or not len(ticks):
            return np.fromiter((self.take(int(tick)) for tick in ticks), np.bool_, len(ticks))
        self.last = self._guard.last = int(ticks[-1])
        self.received += len(ticks)
        return np.ones(len(ticks), np.bool_)

    def _pass_over(self, tick: int, step: int) -> None:
        # those between may still come, late, unless they were sent during a pause
        if self._is_resuming:
            self._is_resuming = False
            self._left_out += tick - max(0, self.last)
            self._pauses += self.received > 0
        if step < tick - self.last <= LONGEST_JUMP:
            self._holes.update(range(self.last + 1, tick))

    def _take_late(self, tick: int) -> None:
        self._holes.remove(tick)
        self._note_step(min(abs(tick - self.first), self.last - tick))
        self.first = min(self.first, tick)

    def _note_step(self, step: int) -> None:
        self.unit = min(self.unit, step) if self.unit else step

    @property
    def gaps(self) -> int:
        """Number of missing messages before the last received one, if the first is of tick 0."""
        places = (self.last - self._left_out) // (self.unit or 1) + 1 + self._pauses
        return max(0, places - self.received)

    def pause(self) -> None:
        """Accept any later tick as the next one: messages before it are excluded on purpose."""
        self._guard = StampGuard(LONGEST_JUMP)
        self._is_resuming = True

    @property
    def kept(self) -> int:
        """Messages that belong into a bag."""
        return self.received + self.invalid_stamps

    def missing(self, last_tick: int) -> int:
        """Messages that were sent but are not here, for a flight from tick 0 to ``last_tick``."""
        if self.topic.is_event or (self.topic.is_optional and not self.received):
            return 0
        if self.topic.per_tick:
            return last_tick + 1 - self.received
        if self.received == 0:
            return 1 if last_tick >= 0 else 0
        return (self.last - self.first) // (self.unit or 1) + 1 - self.received


class SequenceCount:
    """Count of one topic's messages by its publisher's numbers, which begin at 1 in each node."""

    def __init__(self) -> None:
        self.is_counted = False
        """True if the publisher numbers its messages."""
        self.passed_over = 0
        """Number of messages sent while recording was paused."""
        self._received = self._last = self._reported = 0
        self._earlier_holes = self._earlier_tail = 0
        """Of publishers that have ended."""
        self._is_resuming = False

    def take(self, sequence: int) -> None:
        """Count a message; a ``sequence`` of 0 is unknown and ignored."""
        if not sequence:
            return
        self.is_counted = True
        if sequence <= self._last:  # of a restarted node
            self._earlier_holes, self._earlier_tail = self.holes, self.tail
            self._received = self._last = self._reported = 0
        if self._is_resuming:
            self._is_resuming = False
            passed_over = sequence - self._last - 1
            self.passed_over += passed_over
            self._received += passed_over
        self._received += 1
        self._last = sequence

    def note_sent(self, count: int) -> None:
        """Store the number of sent messages that the publisher's node reports."""
        self._reported = count
        self.is_counted = self.is_counted or count > 0

    def pause(self) -> None:
        """Ignore what is sent until the next received message."""
        self._is_resuming = True

    @property
    def holes(self) -> int:
        """Number of missing messages that were sent before the last received one."""
        return self._earlier_holes + self._last - self._received

    @property
    def tail(self) -> int:
        """Number of messages that were sent after the last received one."""
        return self._earlier_tail + self.awaited

    @property
    def awaited(self) -> int:
        """Number of messages that the publisher has sent and that may still arrive."""
        return 0 if self._is_resuming else max(0, self._reported - self._last)


def lost_messages(
    accounting: Mapping[str, MessageAccounting],
    excused: frozenset[str] = frozenset(),
    finished: bool = True,
) -> dict[str, int]:
    """Missing messages a topic; the flight's length is that of the longest per-tick topic.

    Gaps in the ``excused`` topics are not lost messages. Of a bag that was not
    ``finished`` each topic counts up to its own last message: nobody knows what came after.
    """
    lost = {
        name: counted.missing(_last_tick(accounting) if finished else counted.last)
        for name, counted in accounting.items()
    }
    return lost | dict.fromkeys(excused & lost.keys(), 0)


def topics_with_allowed_gaps(flight: Mapping[str, Any]) -> frozenset[str]:
    """Topics that may have ticks without a message in a flight of this description.

    By the wall clock, or where something fails, the controller does not answer every tick
    (`unanswered_ticks`); states may be kept back by a fault.
    """
    excused: tuple[topics.Topic, ...] = ()
    if any(flight.get(key) for key in ("realtime", "faults", "restart_controller")):
        excused += (topics.COMMAND, topics.TELEMETRY, topics.SIGNALS)
    if flight.get("faults"):
        excused += topics.STATES
    return frozenset(topic.full_name for topic in excused)


def unanswered_ticks(accounting: Mapping[str, MessageAccounting], finished: bool = True) -> int:
    """Ticks without a command."""
    command = accounting[topics.COMMAND.full_name]
    return command.missing(_last_tick(accounting) if finished else command.last)


def _last_tick(accounting: Mapping[str, MessageAccounting]) -> int:
    return max((c.last for c in accounting.values() if c.topic.per_tick), default=-1)
