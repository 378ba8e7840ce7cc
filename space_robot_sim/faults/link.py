"""A link that loses, repeats and delays messages, in whole ticks."""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Generic, NamedTuple, TypeVar

from .grammar import PROBABILITY, TICKS, Kind
from .schedule import Schedule

Item = TypeVar("Item")


class LinkKinds(NamedTuple):
    """Kinds of faults of a link."""

    drop: Kind
    repeat: Kind
    delay: Kind
    jitter: Kind

    @classmethod
    def of(cls, what: str) -> LinkKinds:
        """Declare those of the link that carries ``what``: "state" or "command"."""
        return cls(
            Kind(f"drop_{what}", PROBABILITY, 1.0, f"a {what} is lost"),
            Kind(f"repeat_{what}", PROBABILITY, 1.0, f"a {what} arrives again one tick later"),
            Kind(f"delay_{what}", TICKS, 1.0, f"{what}s arrive TICKS late"),
            Kind(
                f"jitter_{what}",
                TICKS,
                1.0,
                f"{what}s arrive 0 to TICKS late, uniformly distributed",
            ),
        )


STATE_LINK, COMMAND_LINK = LinkKinds.of("state"), LinkKinds.of("command")
"""From the sensors to the controller, and back to the actuators."""


@dataclass(frozen=True, slots=True, order=True)
class DelayedMessage(Generic[Item]):
    """A message in transit; messages sort by arrival."""

    due: int
    """Tick of arrival."""
    serial: int
    """Tells messages of one tick apart, in the order sent."""
    stamp: int = field(compare=False)
    """Tick in its stamp, correct or wrong."""
    item: Item = field(compare=False)


class Link(Generic[Item]):
    """Link for states to the controller (`STATE_LINK`) or commands back (`COMMAND_LINK`).

    What is sent in one tick shares its fate. Delays add up; where they shrink or scatter, later
    items may overtake earlier ones. Items that arrive in one tick keep the order of sending.
    """

    def __init__(self, schedule: Schedule, kinds: LinkKinds) -> None:
        self._drops = schedule.of(kinds.drop)
        self._repeats = schedule.of(kinds.repeat)
        self._delays = schedule.of(kinds.delay)
        self._jitters = schedule.of(kinds.jitter)
        self._under_way: list[DelayedMessage[Item]] = []
        self._sent = 0

    def send(self, tick: int, item: Item, stamp: int | None = None) -> None:
        """Send ``item`` at ``tick``; ``stamp`` is the tick that it carries if it differs."""
        if any(fault.happens_at(tick) for fault in self._drops):
            return
        due = tick + sum(int(fault.value) for fault in self._delays if fault.acts_at(tick))
        for fault in self._jitters:
            if fault.acts_at(tick):
                due += fault.choose(tick, int(fault.value) + 1)
        carried = tick if stamp is None else stamp
        copies = 1 + any(fault.happens_at(tick) for fault in self._repeats)
        for copy in range(copies):
            heapq.heappush(self._under_way, DelayedMessage(due + copy, self._sent, carried, item))
        self._sent += 1

    def arrivals(self, tick: int) -> list[DelayedMessage[Item]]:
        """Return new arrivals up to ``tick``, in order of arrival."""
        arrived = []
        while self._under_way and self._under_way[0].due <= tick:
            arrived.append(heapq.heappop(self._under_way))
        return arrived

    def push(self, tick: int, item: Item, stamp: int | None = None) -> list[DelayedMessage[Item]]:
        """Call `send`, then `arrivals`."""
        self.send(tick, item, stamp)
        return self.arrivals(tick)


def awaited_stamp(states: Iterable[DelayedMessage[Item]], tick: int, answered: int) -> int | None:
    """Return the tick whose command will come when these states reach a controller at ``tick``.

    It is the newest stamp among them, for a controller that leaves alone what is no newer than
    what it answered last (``answered``) and what lies in the future. None: no answer will come.
    """
    fresh = [state.stamp for state in states if answered < state.stamp <= tick]
    return max(fresh, default=None)
