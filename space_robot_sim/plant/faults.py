"""All faults of one flight that the plant brings about."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotState

from ..actuators.faults import ActuatorFaults
from ..faults.catalogue import PLANT_KINDS, Fault
from ..faults.link import Link
from ..faults.schedule import Schedule
from ..robot import Robot
from ..sensors.corruption import Corruption
from ..sensors.faults import SensorFaults


class PlantFaults:
    """False if there are none: then nothing of this need be called.

    In the order of a tick: `actuators` before the step, `measure` and `states` on the way to
    the controller, `commands` and `corruption` on the way back.
    """

    def __init__(self, faults: Sequence[Fault], seed: int, robot: Robot, period: float) -> None:
        """Prepare ``faults`` for a flight of ``robot`` in ticks of ``period`` seconds.

        Raises:
            InputError: a fault is not the plant's, names a joint that is not there, or its time
                holds no tick.
        """
        for fault in faults:
            one_of(fault.kind, PLANT_KINDS, "fault of the plant")
            if fault.joint > robot.n:
                raise InputError(f"fault '{fault}': robot {robot.name!r} has joints 1 to {robot.n}")
        schedule = Schedule(faults, seed, period)
        self._any = bool(faults)
        self.actuators = ActuatorFaults(schedule)
        self.sensors = SensorFaults(schedule, robot.n)
        self.corruption = Corruption(schedule)
        self.states: Link[Any] = Link(schedule, "state")
        """Both messages of a tick are one item."""
        self.commands: Link[Any] = Link(schedule, "command")

    def __bool__(self) -> bool:
        return self._any

    def measure(self, state: RobotState) -> RobotState:
        """What to send in place of the true ``state``, which is left alone; reused.

        Its ``tick`` is the stamp to write on it, which may be wrong.
        """
        measured = self.sensors.measure(state)
        self.corruption.spoil_state(measured, state.tick)
        measured.tick = self.corruption.stamp(state.tick)
        return measured
