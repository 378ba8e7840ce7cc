"""Messages between plant and controller in a tick, with or without faults. Independent of ROS.

In the order of a tick: `PlantMessages.send` the state, `PlantMessages.take` the commands that come
for it, `PlantMessages.end`; then `CommandGuard.act` says which command acts.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from space_robot_msgs_py.samples import Command, RobotNames, RobotState
from space_robot_msgs_py.wire.codecs import StateCodec

from ..faults.messages import MessageFaults, awaited_stamp
from .settings import FaultSettings


class CommandGuard:
    """Guard of the command in force. Independent of ROS.

    A command is good if it is finite, and answers a state that has been sent and is newer than the
    one answered before.
    It acts until ``hold_ticks`` after the state it answers, however late it came; then, without a
    newer one, the torque is zero.
    """

    def __init__(self, axes: int, hold_ticks: int) -> None:
        self._hold_ticks = hold_ticks
        self._accepted, self.offered = (Command(-1, np.zeros(axes)) for _ in range(2))
        """``offered``: to be filled with a command that has come, for `accept`."""
        self._none = Command(-1, np.zeros(axes))
        self.acting = self._none
        """The command that acts at the tick last given to `act`."""
        self.refused: Counter[str] = Counter()
        """Number of refused commands by reason."""

    @property
    def answered(self) -> int:
        """Tick of the last accepted command; -1 if none."""
        return self._accepted.tick

    @property
    def is_safe(self) -> bool:
        """True if commands have failed for so long that the torque is zero."""
        return self.acting is self._none

    def held_ticks(self, now: int) -> int:
        """Return the age at ``now`` of the state that the last good command answers, ticks."""
        return now - self._accepted.tick

    def accept(self, now: int) -> bool:
        """Take the command in `offered` at tick ``now``; False, and counted, if it is not good."""
        if not self._accepted.tick < self.offered.tick <= now:
            self.refused["stamp"] += 1
            return False
        torque = self.offered.torque
        # a sum takes a third of the time of `isfinite`; finite, unless a number is not or huge
        if not (math.isfinite(sum(torque.tolist())) or np.isfinite(torque).all()):
            self.refused["not finite"] += 1
            return False
        # two buffers change places: nothing is allocated in a tick
        self._accepted, self.offered = self.offered, self._accepted
        return True

    def refuse(self, reason: str) -> None:
        """Count a command that could not be read."""
        self.refused[reason] += 1

    def release(self) -> None:
        """Set the torque to zero until the next valid command."""
        self._accepted.torque[:] = 0.0

    def act(self, now: int) -> Command:
        """Return the command for tick ``now``."""
        held = self.answered >= 0 and self.held_ticks(now) <= self._hold_ticks
        self.acting = self._accepted if held else self._none
        return self.acting


NO_TICK = -1
"""No tick."""


class SentState(NamedTuple):
    """A measured state as it goes out."""

    messages: tuple[bytes, ...]
    """Its parts, in the order of `StateCodec.topics`."""
    answered_by: int
    """Tick of the command that will come for it; `NO_TICK`: no command will."""


class PlantMessages:
    """Passes states to the controller and commands back, with the faults of messages.

    A state that is lost, late or wrongly stamped has no answer to wait for: that is known here,
    so that a flight in lockstep repeats.
    """

    def __init__(
        self,
        settings: FaultSettings,
        names: RobotNames,
        period: float,
        codec: StateCodec,
        guard: CommandGuard,
    ) -> None:
        self._codec, self._guard = codec, guard
        self._faults: MessageFaults | None = None
        if settings.has_message_faults:
            schedule = settings.schedule(names, period)
            self._faults = MessageFaults(schedule, len(names.joints), len(names.passive))
        self._asked = NO_TICK
        """Tick of the newest state that a controller can have answered."""

    def send(self, state: RobotState) -> Iterable[SentState]:
        """Return what reaches the controller in the tick of the measured ``state``."""
        if self._faults is None:
            return (SentState(self._codec.encode(state), state.tick),)
        measured = self._faults.measure(state)
        sent = []
        messages = self._codec.encode(measured)
        for arriving in self._faults.states.push(state.tick, messages, measured.tick):
            stamp = awaited_stamp([arriving], state.tick, self._asked)
            if stamp is not None:
                self._asked = stamp
            sent.append(SentState(arriving.item, NO_TICK if stamp is None else stamp))
        return sent

    def take(self, tick: int) -> None:
        """Take the command in the guard's ``offered``, which has come at ``tick``.

        With faults it may act in a later tick, or never.
        """
        if self._faults is None:
            self._guard.accept(tick)
            return
        offered = self._guard.offered
        self._faults.corrupt_command(offered, tick)
        self._faults.commands.send(tick, offered.torque.copy(), offered.tick)

    def end(self, tick: int) -> None:
        """End the exchange of ``tick``, for which no more commands will come."""
        guard = self._guard
        for command in self._faults.commands.arrivals(tick) if self._faults else ():
            guard.offered.tick, guard.offered.torque[:] = command.stamp, command.item
            guard.accept(tick)
