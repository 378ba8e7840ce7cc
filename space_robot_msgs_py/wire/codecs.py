"""States and commands to messages and back, in the time of a tick."""

from __future__ import annotations

from collections.abc import Sequence

from ..samples import Command, RobotNames, RobotState, State, Timebase
from ..topics import Topic
from .base_state import BaseState
from .command import Commands
from .compiled_codec import CompiledCodec
from .joint_states import JointStates
from .message import MessageDescription
from .thrusters_state import ThrustersState
from .wheels_state import WheelsState

PARTS: tuple[type[MessageDescription], ...] = (JointStates, WheelsState, BaseState, ThrustersState)
"""The messages of a state in the order in which they are sent."""

FOR_THE_RECORD = (ThrustersState.topic,)


class StateCodec:
    """`RobotState` as its messages: a part for the joints, the base, its wheels, its thrusters."""

    def __init__(self, names: RobotNames, timebase: Timebase) -> None:
        """Wheels and thrusters have a part where ``names`` has any."""
        self._timebase, record = timebase, State.dtype(len(names.joints))
        parts = [part.of_robot(names, timebase) for part in PARTS]
        self.parts = {
            part.topic: CompiledCodec(part, record)
            for part in parts
            if part.names or not part.topic.is_optional
        }
        self.topics = tuple(self.parts)
        """Those of the parts, in the order in which they are sent."""
        self.control_topics = tuple(t for t in self.topics if t not in FOR_THE_RECORD)
        """Those of the parts that a controller needs."""

    def encode(self, state: RobotState) -> tuple[bytes, ...]:
        """The bytes of every part."""
        stamp_ns, numbers = self._timebase.stamp_ns(state.tick), state.numbers
        return tuple([codec.encode(stamp_ns, numbers) for codec in self.parts.values()])

    def decode(self, topic: Topic, data: bytes, state: RobotState) -> int:
        """Fill one part of ``state``; returns the tick.

        Raises:
            MessageError: the message does not fit.
        """
        return self._timebase.tick(self.parts[topic].decode(data, state.numbers))


class CommandCodec:
    """`Command` as /command."""

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """``names``: see `RobotNames.commanded`."""
        self._timebase = timebase
        self._codec = CompiledCodec(Commands(names, timebase))

    def encode(self, command: Command) -> bytes:
        """The bytes of /command, stamped with the state it answers."""
        return self._codec.encode(self._timebase.stamp_ns(command.tick), command.torque)

    def decode(self, data: bytes, command: Command) -> None:
        """Fill ``command``.

        Raises:
            MessageError: the message does not fit.
        """
        command.tick = self._timebase.tick(self._codec.decode(data, command.torque))
