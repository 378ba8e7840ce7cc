"""All faults of one flight that the plant brings about, and the catalogue of their kinds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.samples import RobotState

from ..actuators import actuators
from ..environment import environment
from ..faults.corruption import Corruption
from ..faults.grammar import Fault, by_name
from ..faults.link import COMMAND_LINK, STATE_LINK, Link
from ..faults.schedule import Schedule
from ..robot import Robot
from ..sensors import faults as sensors
from .plant import Plant

PLANT_KINDS = by_name(
    *STATE_LINK, *COMMAND_LINK, *Corruption.KINDS,
    *(kind for fault in sensors.FAULTS for kind in fault.FIELDS),
    *(kind for fault in actuators.FAULTS.values() for kind in fault.KINDS),
    *(kind for fault in environment.FAULTS.values() for kind in fault.KINDS),
)  # fmt: skip
"""All kinds of faults that the plant brings about."""


class PlantFaults:
    """The faults of one flight; false if there are none: then nothing of this need be called.

    In the order of a tick: `apply` before the step, `measure` and `states` on the way to the
    controller, `commands` and `corruption` on the way back.
    """

    def __init__(self, faults: Sequence[Fault], seed: int, robot: Robot, period: float) -> None:
        """Prepare ``faults`` for a flight of ``robot`` in ticks of ``period`` seconds.

        Raises:
            InputError: a fault is not the plant's, names an axis that is not there, or its time
                holds no tick.
        """
        for fault in faults:
            one_of(fault.kind.name, PLANT_KINDS, "fault of the plant")
        schedule = Schedule(faults, seed, period, robot.axis_names)
        self._any = bool(faults)
        self._of_actuators = [(part, cls(schedule)) for part, cls in actuators.FAULTS.items()]
        self._of_environment = [(part, cls(schedule)) for part, cls in environment.FAULTS.items()]
        self.sensors = sensors.SensorFaults(schedule, robot.n)
        self.corruption = Corruption(schedule)
        self.states: Link[Any] = Link(schedule, STATE_LINK)
        """Both messages of a tick are one item."""
        self.commands: Link[Any] = Link(schedule, COMMAND_LINK)

    def __bool__(self) -> bool:
        return self._any

    def apply(self, plant: Plant) -> None:
        """Make actuators and environment fail as they should from the plant's tick to the next."""
        memory = plant.memory
        for part, fault in self._of_actuators:
            fault.apply(plant.tick, getattr(memory.actuators, part))
        for part, fault in self._of_environment:
            fault.apply(plant.tick, getattr(memory.environment, part))

    def measure(self, state: RobotState) -> RobotState:
        """Return what to send in place of the true ``state``, which is left alone; reused.

        Its ``tick`` is the stamp to write on it, which may be wrong.
        """
        measured = self.sensors.measure(state)
        self.corruption.spoil_state(measured, state.tick)
        measured.tick = self.corruption.stamp(state.tick)
        return measured
