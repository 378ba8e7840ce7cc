"""Faults of the messages between plant and controller: lost, late, repeated, corrupted."""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np

from space_robot_msgs_py.samples import PASSIVE_FIELDS, SENSED_FIELDS, Command, RobotState

from .grammar import Argument, Kind, by_name
from .schedule import Schedule

Item = TypeVar("Item")

PROBABILITY = Argument("P", "probability per tick", 0.0, 1.0, default=1.0)
TICKS = Argument("TICKS", "ticks", 0.0, 1e6, whole=True, default=1.0)


MESSAGE_KINDS = by_name(
    *(
        kind
        for what in ("state", "command")
        for kind in (
            Kind(f"drop_{what}", PROBABILITY, f"a {what} is lost"),
            Kind(f"repeat_{what}", PROBABILITY, f"a {what} arrives again one tick later"),
            Kind(f"delay_{what}", TICKS, f"{what}s arrive TICKS late"),
            Kind(f"jitter_{what}", TICKS, f"{what}s arrive 0 to TICKS late, uniformly distributed"),
        )
    ),
    Kind("nan_state", PROBABILITY, "one measured number is NaN"),
    Kind("inf_state", PROBABILITY, "one measured number is infinite"),
    Kind("scaled_quaternion", PROBABILITY, "the measured quaternion's norm is 0.9 or 1.1"),
    Kind("stamp_back", PROBABILITY, "a state's stamp is 1 to 10 ticks early"),
    Kind("stamp_jump", PROBABILITY, "a state's stamp is 1000000 ticks late"),
    Kind("nan_command", PROBABILITY, "one commanded torque is NaN"),
    Kind("inf_command", PROBABILITY, "one commanded torque is infinite"),
)
"""The kinds of faults of messages between plant and controller."""
QUATERNION_NORMS = (0.9, 1.1)
STAMP_BACK_TICKS = 10
"""A stamp goes back by 1 to this many ticks."""
STAMP_JUMP_TICKS = 1_000_000


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
    """Link for states to the controller or commands back.

    What is sent in one tick shares its fate. Delays add up; where they shrink or scatter, later
    items may overtake earlier ones. Items that arrive in one tick keep the order of sending.
    """

    def __init__(self, schedule: Schedule, what: str) -> None:
        """``what`` the link carries: "state" or "command"."""
        self._drops = schedule.of(f"drop_{what}")
        self._repeats = schedule.of(f"repeat_{what}")
        self._delays = schedule.of(f"delay_{what}")
        self._jitters = schedule.of(f"jitter_{what}")
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

    That is the newest stamp among them, since a controller does not answer states that are no newer
    than the last one it answered (``answered``), or lie in the future. None: no answer will come.
    """
    fresh = [state.stamp for state in states if answered < state.stamp <= tick]
    return max(fresh, default=None)


class MessageFaults:
    """The faults of the messages of one flight.

    In the order of a tick: `measure` and `states` on the way to the controller, `corrupt_command`
    and `commands` on the way back.
    """

    def __init__(self, schedule: Schedule, n: int, passive: int = 0) -> None:
        """Prepare those that ``schedule`` has.

        The robot has ``n`` joints with motors, ``passive`` without.
        """
        self.states: Link[Any] = Link(schedule, "state")
        """All messages of a tick's state are one item."""
        self.commands: Link[Any] = Link(schedule, "command")
        self._schedule, self._passive = schedule, passive
        self._measured = RobotState.allocate(n)

    def measure(self, state: RobotState) -> RobotState:
        """Return what to send in place of the measured ``state``, which is left alone; reused.

        Its ``tick`` is the stamp to write on it, which may be wrong.
        """
        measured = self._measured
        measured.block[:] = state.block
        self.corrupt_state(measured, state.tick)
        measured.tick = self.stamp(state.tick)
        return measured

    def corrupt_state(self, state: RobotState, tick: int) -> None:
        """Corrupt the measurements of ``tick``, but not the echo of the applied torque."""
        for fault in self._schedule.of("scaled_quaternion"):
            if fault.happens_at(tick):
                state.quaternion *= QUATERNION_NORMS[fault.choose(tick, 2)]
        for kind, value in (("nan_state", np.nan), ("inf_state", np.inf)):
            for fault in self._schedule.of(kind):
                if fault.happens_at(tick):
                    arrays = [getattr(state, name) for name in SENSED_FIELDS]
                    arrays += [getattr(state, name)[: self._passive] for name in PASSIVE_FIELDS]
                    # of all numbers any as likely, counted through the arrays
                    place = fault.choose(tick, sum(array.size for array in arrays))
                    for array in arrays:
                        if 0 <= place < array.size:
                            array[place] = value
                        place -= array.size

    def corrupt_command(self, command: Command, tick: int) -> None:
        """Corrupt a command received by the plant at ``tick``."""
        for kind, value in (("nan_command", np.nan), ("inf_command", np.inf)):
            for fault in self._schedule.of(kind):
                if fault.happens_at(tick):
                    command.torque[fault.choose(tick, command.torque.size)] = value

    def stamp(self, tick: int) -> int:
        """Return the tick to write on the state of ``tick``; never below 0."""
        stamp = tick
        for fault in self._schedule.of("stamp_back"):
            if fault.happens_at(tick):
                stamp -= 1 + fault.choose(tick, STAMP_BACK_TICKS)
        for fault in self._schedule.of("stamp_jump"):
            if fault.happens_at(tick):
                stamp += STAMP_JUMP_TICKS
        return max(stamp, 0)
