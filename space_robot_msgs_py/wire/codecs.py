"""Fast conversion of states and commands to messages and back."""

from __future__ import annotations

from collections.abc import Sequence

from ..samples import Command, RobotNames, RobotState, State, Timebase
from ..topics import Topic
from .base_state import BaseState
from .command import Commands
from .compiled_codec import CompiledCodec
from .joint_states import JointStates
from .magnetometer import Magnetometer
from .message import MessageDescription
from .motors_state import MotorsState
from .thrusters_state import ThrustersState
from .wheels_state import WheelsState

PARTS: tuple[type[MessageDescription], ...] = (
    JointStates,
    WheelsState,
    BaseState,
    ThrustersState,
    MotorsState,
    Magnetometer,
)
"""Messages of a state in the order of sending."""

FOR_THE_RECORD = (ThrustersState.topic, MotorsState.topic)


class StateCodec:
    """Converts `RobotState` to the messages of its parts, see `PARTS`, and back."""

    def __init__(self, names: RobotNames, timebase: Timebase) -> None:
        """Create the codecs; of parts that not every robot has only if ``names`` has any."""
        self._timebase, record = timebase, State.dtype(len(names.joints))
        parts = [part.of_robot(names, timebase) for part in PARTS]
        self.parts = {
            part.topic: CompiledCodec(part, record)
            for part in parts
            if part.names or not part.topic.is_optional
        }
        self.topics = tuple(self.parts)
        """Topics of all messages, in the order of sending."""
        self.control_topics = tuple(t for t in self.topics if t not in FOR_THE_RECORD)
        """Topics of the messages that a controller needs."""

    def encode(self, state: RobotState) -> tuple[bytes, ...]:
        """Return the bytes of all messages."""
        stamp_ns, numbers = self._timebase.stamp_ns(state.tick), state.numbers
        return tuple([codec.encode(stamp_ns, numbers) for codec in self.parts.values()])

    def decode(self, topic: Topic, data: bytes, state: RobotState) -> int:
        """Write one message into ``state``; return its tick.

        Raises:
            MessageError: the message does not fit.
        """
        return self._timebase.tick(self.parts[topic].decode(data, state.numbers))


class CommandCodec:
    """Converts `Command` to /command and back."""

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Create the codec; ``names`` are those of `RobotNames.commanded`."""
        self._timebase = timebase
        self._codec = CompiledCodec(Commands(names, timebase))

    def encode(self, command: Command) -> bytes:
        """Return the bytes of /command, with the stamp of the state that it answers."""
        return self._codec.encode(self._timebase.stamp_ns(command.tick), command.torque)

    def decode(self, data: bytes, command: Command) -> None:
        """Write a message into ``command``.

        Raises:
            MessageError: the message does not fit.
        """
        command.tick = self._timebase.tick(self._codec.decode(data, command.torque))
