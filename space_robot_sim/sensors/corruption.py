"""Messages whose content makes no sense: not finite, not unit, wrongly stamped."""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.samples import Command, RobotState

from ..faults.schedule import Schedule

QUATERNION_NORMS = (0.9, 1.1)
STAMP_BACK_TICKS = 10
"""A stamp goes back by one tick to as many."""
STAMP_JUMP_TICKS = 1_000_000
MEASURED = (
    "base_position", "quaternion", "base_velocity", "omega_base", "joint_positions",
    "joint_velocities",
)  # fmt: skip


class Corruption:
    """Spoils samples in place; what is spoilt at a tick depends on the tick alone."""

    def __init__(self, schedule: Schedule) -> None:
        self._states = [
            (fault, value) for kind, value in (("nan_state", np.nan), ("inf_state", np.inf))
            for fault in schedule.of(kind)
        ]  # fmt: skip
        self._quaternions = schedule.of("scaled_quaternion")
        self._commands = [
            (fault, value) for kind, value in (("nan_command", np.nan), ("inf_command", np.inf))
            for fault in schedule.of(kind)
        ]  # fmt: skip
        self._back = schedule.of("stamp_back")
        self._jump = schedule.of("stamp_jump")

    def spoil_state(self, state: RobotState, tick: int) -> None:
        """Spoil what is measured at ``tick``; not the echo of the applied torque."""
        for fault in self._quaternions:
            if fault.happens_at(tick):
                state.quaternion *= QUATERNION_NORMS[fault.choose(tick, 2)]
        for fault, value in self._states:
            if fault.happens_at(tick):
                arrays = [getattr(state, name) for name in MEASURED]
                place = fault.choose(tick, sum(array.size for array in arrays))
                for array in arrays:
                    if 0 <= place < array.size:
                        array[place] = value
                    place -= array.size

    def spoil_command(self, command: Command, tick: int) -> None:
        """Spoil a command that has come to the plant at ``tick``."""
        for fault, value in self._commands:
            if fault.happens_at(tick):
                command.torque[fault.choose(tick, command.torque.size)] = value

    def stamp(self, tick: int) -> int:
        """The tick to write on the state of ``tick``; never below 0."""
        stamp = tick
        for fault in self._back:
            if fault.happens_at(tick):
                stamp -= 1 + fault.choose(tick, STAMP_BACK_TICKS)
        for fault in self._jump:
            if fault.happens_at(tick):
                stamp += STAMP_JUMP_TICKS
        return max(stamp, 0)
