"""Corruption of messages: not finite, not unit, wrong stamp."""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.samples import PASSIVE_FIELDS, SENSED_FIELDS, Command, RobotState

from .grammar import PROBABILITY, Kind
from .schedule import Schedule

QUATERNION_NORMS = (0.9, 1.1)
STAMP_BACK_TICKS = 10
"""A stamp goes back by 1 to this many ticks."""
STAMP_JUMP_TICKS = 1_000_000
NAN_STATE = Kind("nan_state", PROBABILITY, 1.0, "one measured number is NaN")
INF_STATE = Kind("inf_state", PROBABILITY, 1.0, "one measured number is infinite")
SCALED_QUATERNION = Kind(
    "scaled_quaternion", PROBABILITY, 1.0, "the measured quaternion's norm is 0.9 or 1.1"
)
STAMP_BACK = Kind("stamp_back", PROBABILITY, 1.0, "a state's stamp is 1 to 10 ticks early")
STAMP_JUMP = Kind("stamp_jump", PROBABILITY, 1.0, "a state's stamp is 1000000 ticks late")
NAN_COMMAND = Kind("nan_command", PROBABILITY, 1.0, "one commanded torque is NaN")
INF_COMMAND = Kind("inf_command", PROBABILITY, 1.0, "one commanded torque is infinite")


class Corruption:
    """Corruption of samples in place, as a function of the tick alone."""

    KINDS = (
        NAN_STATE,
        INF_STATE,
        SCALED_QUATERNION,
        STAMP_BACK,
        STAMP_JUMP,
        NAN_COMMAND,
        INF_COMMAND,
    )

    def __init__(self, schedule: Schedule, passive: int = 0) -> None:
        """``passive``: the robot has so many joints without motors."""
        self._passive = passive
        self._states = [
            (fault, value)
            for kind, value in ((NAN_STATE, np.nan), (INF_STATE, np.inf))
            for fault in schedule.of(kind)
        ]
        self._quaternions = schedule.of(SCALED_QUATERNION)
        self._commands = [
            (fault, value)
            for kind, value in ((NAN_COMMAND, np.nan), (INF_COMMAND, np.inf))
            for fault in schedule.of(kind)
        ]
        self._back = schedule.of(STAMP_BACK)
        self._jump = schedule.of(STAMP_JUMP)

    def corrupt_state(self, state: RobotState, tick: int) -> None:
        """Corrupt the measurements of ``tick``, but not the echo of the applied torque."""
        for fault in self._quaternions:
            if fault.happens_at(tick):
                state.quaternion *= QUATERNION_NORMS[fault.choose(tick, 2)]
        for fault, value in self._states:
            if fault.happens_at(tick):
                arrays = [getattr(state, name) for name in SENSED_FIELDS]
                arrays += [getattr(state, name)[: self._passive] for name in PASSIVE_FIELDS]
                place = fault.choose(tick, sum(array.size for array in arrays))
                for array in arrays:
                    if 0 <= place < array.size:
                        array[place] = value
                    place -= array.size

    def corrupt_command(self, command: Command, tick: int) -> None:
        """Corrupt a command received by the plant at ``tick``."""
        for fault, value in self._commands:
            if fault.happens_at(tick):
                command.torque[fault.choose(tick, command.torque.size)] = value

    def stamp(self, tick: int) -> int:
        """Return the tick to write on the state of ``tick``; never below 0."""
        stamp = tick
        for fault in self._back:
            if fault.happens_at(tick):
                stamp -= 1 + fault.choose(tick, STAMP_BACK_TICKS)
        for fault in self._jump:
            if fault.happens_at(tick):
                stamp += STAMP_JUMP_TICKS
        return max(stamp, 0)
