"""States and commands to messages and back, in the time of a tick."""

from __future__ import annotations

from collections.abc import Sequence

from ..samples import Command, RobotState, State, Timebase
from .base_state import BaseState
from .command import Commands
from .compiled_codec import CompiledCodec
from .joint_states import JointStates


class StateCodec:
    """`RobotState` as the pair /joint_states and /base/state."""

    def __init__(self, joint_names: Sequence[str], timebase: Timebase) -> None:
        self._timebase, record = timebase, State.dtype(len(joint_names))
        self._joints = CompiledCodec(JointStates(joint_names, timebase), record)
        self._base = CompiledCodec(BaseState(joint_names, timebase), record)

    def encode(self, state: RobotState) -> tuple[bytes, bytes]:
        """The bytes of /joint_states and /base/state."""
        stamp_ns = self._timebase.stamp_ns(state.tick)
        numbers = state.numbers
        return self._joints.encode(stamp_ns, numbers), self._base.encode(stamp_ns, numbers)

    def decode_joints(self, data: bytes, state: RobotState) -> int:
        """Fill the joints' part of ``state``; returns the tick.

        Raises:
            MessageError: the message does not fit.
        """
        return self._timebase.tick(self._joints.decode(data, state.numbers))

    def decode_base(self, data: bytes, state: RobotState) -> int:
        """Fill the base's part of ``state``; returns the tick.

        Raises:
            MessageError: the message does not fit.
        """
        return self._timebase.tick(self._base.decode(data, state.numbers))


class CommandCodec:
    """`Command` as /command."""

    def __init__(self, axis_names: Sequence[str], timebase: Timebase) -> None:
        self._timebase = timebase
        self._codec = CompiledCodec(Commands(axis_names, timebase))

    def encode(self, command: Command) -> bytes:
        """The bytes of /command, stamped with the state it answers."""
        return self._codec.encode(self._timebase.stamp_ns(command.tick), command.torque)

    def decode(self, data: bytes, command: Command) -> None:
        """Fill ``command``.

        Raises:
            MessageError: the message does not fit.
        """
        command.tick = self._timebase.tick(self._codec.decode(data, command.torque))
