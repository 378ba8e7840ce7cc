"""Messages between plant and controller in a tick, with or without faults. Independent of ROS.

In the order of a tick: `PlantMessages.send` the state, `PlantMessages.take` the commands that come
for it, `PlantMessages.end`; then `CommandGuard.act` says which command acts.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from space_robot_msgs_py.samples import RobotNames, RobotState
from space_robot_msgs_py.wire.codecs import StateCodec

from ..faults.messages import MessageFaults, awaited_stamp
from .command_guard import CommandGuard
from .faults import FaultSettings

NONE = -1
"""No tick."""


class SentState(NamedTuple):
    """A measured state as it goes out."""

    messages: tuple[bytes, ...]
    """Its parts, in the order of `StateCodec.topics`."""
    answered_by: int
    """Tick of the command that will come for it; `NONE`: no command will."""


class PlantMessages:
    """Hands every state out, and every command in."""

    def __init__(self, codec: StateCodec, guard: CommandGuard) -> None:
        self._codec, self._guard = codec, guard

    def send(self, state: RobotState) -> Iterable[SentState]:
        """Return what reaches the controller in the tick of the measured ``state``."""
        return (SentState(self._codec.encode(state), state.tick),)

    def take(self, tick: int) -> None:
        """Take the command in the guard's ``offered``, which has come at ``tick``."""
        self._guard.accept(tick)

    def end(self, tick: int) -> None:
        """End the exchange of ``tick``: all that has come for it is there."""


class FaultyExchange(PlantMessages):
    """Messages are lost, late, repeated and spoilt, as a flight's faults say.

    A state that is lost, late or wrongly stamped has no answer to wait for: that is known here,
    so that a flight in lockstep repeats.
    """

    def __init__(self, codec: StateCodec, guard: CommandGuard, faults: MessageFaults) -> None:
        super().__init__(codec, guard)
        self._faults = faults
        self._asked = NONE
        """Tick of the newest state that a controller can have answered."""

    def send(self, state: RobotState) -> Iterator[SentState]:
        """Return what reaches the controller, with faults."""
        tick, faults = state.tick, self._faults
        measured = faults.measure(state)
        messages = self._codec.encode(measured)
        for arriving in faults.states.push(tick, messages, measured.tick):
            stamp = awaited_stamp([arriving], tick, self._asked)
            if stamp is not None:
                self._asked = stamp
            yield SentState(arriving.item, NONE if stamp is None else stamp)

    def take(self, tick: int) -> None:
        """See `PlantMessages.take`; the command may act in a later tick, or never."""
        faults, offered = self._faults, self._guard.offered
        faults.corrupt_command(offered, tick)
        faults.commands.send(tick, offered.torque.copy(), offered.tick)

    def end(self, tick: int) -> None:
        """End the exchange of a tick."""
        guard = self._guard
        for command in self._faults.commands.arrivals(tick):
            guard.offered.tick, guard.offered.torque[:] = command.stamp, command.item
            guard.accept(tick)


def exchange_of(
    settings: FaultSettings,
    names: RobotNames,
    period: float,
    codec: StateCodec,
    guard: CommandGuard,
) -> PlantMessages:
    """Return the exchange of a robot's flight: a faulty one if any of its messages are to fail."""
    if not settings.has_message_faults:
        return PlantMessages(codec, guard)
    faults = MessageFaults(settings.schedule(names, period), len(names.joints), len(names.passive))
    return FaultyExchange(codec, guard, faults)
