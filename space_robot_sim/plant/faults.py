"""Faults of a flight caused by the plant, and the catalogue of their kinds.

Those of parts (sensors, actuators, environment) the plant has itself; those of messages act on the
way between plant and controller.
"""

from __future__ import annotations

import copy
import math
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from space_robot_msgs_py.config.settings import Texts
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.samples import RobotNames, RobotState

from ..actuators import actuators
from ..environment import environment
from ..faults.corruption import Corruption
from ..faults.grammar import Fault, by_name, parse_faults
from ..faults.link import COMMAND_LINK, STATE_LINK, Link
from ..faults.schedule import Schedule
from ..sensors import sensors

PARTS = {
    "sensors": sensors.FAULTS,
    "actuators": actuators.FAULTS,
    "environment": environment.FAULTS,
}
"""The faults of each field of the plant's memory, by its own fields."""
MESSAGE_KINDS = by_name(*STATE_LINK, *COMMAND_LINK, *Corruption.KINDS)
"""The kinds of faults of messages between plant and controller."""
PART_KINDS = by_name(
    *(kind for faults in PARTS.values() for fault in faults.values() for kind in fault.KINDS)
)
"""The kinds of faults of sensors, actuators and environment."""
PLANT_KINDS = by_name(*MESSAGE_KINDS.values(), *PART_KINDS.values())
"""All kinds of faults caused by the plant."""


def _readable(texts: list[str]) -> list[str]:
    parse_faults(texts, PLANT_KINDS)
    return texts


class FaultSettings(StrictModel):
    """Settings of the faults of the plant."""

    faults: Annotated[Texts, AfterValidator(_readable)] = Field(
        [""], description="faults of the flight, each `KIND@T[-END][:ARGUMENT]`, see docs/manual"
    )
    fault_seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = Field(
        0, description="seed of the random numbers of faults and sensors"
    )

    @property
    def parsed_faults(self) -> list[Fault]:
        """The faults, without the empty texts."""
        return parse_faults(self.faults, PLANT_KINDS)

    @property
    def has_message_faults(self) -> bool:
        """True if messages between plant and controller have faults."""
        return any(fault.kind.name in MESSAGE_KINDS for fault in self.parsed_faults)

    def schedule(self, names: RobotNames, period: float) -> Schedule:
        """Place the faults in a flight of a robot in ticks of ``period`` seconds.

        Args:
            names: of what the robot has.
            period: s.

        Raises:
            InputError: a fault names what is not there, or its time holds no tick.
        """
        return Schedule(self.parsed_faults, self.fault_seed, period, names)


class PartFaults:
    """The faults of a plant's parts."""

    def __init__(self, schedule: Schedule) -> None:
        """Prepare those that ``schedule`` has."""
        self._faults = [
            (group, part, fault(schedule))
            for group, faults in PARTS.items()
            for part, fault in faults.items()
        ]
        self._schedule = schedule
        acting = schedule.of(*PART_KINDS.values())
        self._turns = sorted({tick for fault in acting for tick in (fault.first, fault.stop)})
        """Ticks at which a fault begins or ends."""

    def __deepcopy__(self, memo: dict[int, Any]) -> PartFaults:
        """Copy the faults, or return self if there are none."""
        copied = PartFaults.__new__(PartFaults)
        memo[id(self)] = copied
        held = vars(self)
        copied.__dict__.update(copy.deepcopy(held, memo) if self._turns else held)
        return copied

    def are_in(self, group: str) -> bool:
        """Return whether any part of a group ("sensors", ...) has a fault."""
        kinds = [kind for fault in PARTS[group].values() for kind in fault.KINDS]
        return bool(self._schedule.of(*kinds))

    def apply(self, tick: int, memory: Any) -> float:
        """Apply the faults to the parts in a plant's memory from ``tick`` on.

        Returns:
            The next tick at which that changes (inf: it does not).
        """
        if self._turns:
            for group, part, fault in self._faults:
                fault.apply(tick, getattr(getattr(memory, group), part))
        return next((turn for turn in self._turns if turn > tick), math.inf)


class MessageFaults:
    """The faults of the messages of one flight.

    In the order of a tick: `measure` and `states` on the way to the controller, `corruption` and
    `commands` on the way back.
    """

    def __init__(self, schedule: Schedule, n: int, passive: int = 0) -> None:
        """Prepare those that ``schedule`` has.

        The robot has ``n`` joints with motors, ``passive`` without.
        """
        self.corruption = Corruption(schedule, passive)
        self.states: Link[Any] = Link(schedule, STATE_LINK)
        """All messages of a tick's state are one item."""
        self.commands: Link[Any] = Link(schedule, COMMAND_LINK)
        self._measured = RobotState.allocate(n)

    def measure(self, state: RobotState) -> RobotState:
        """Return what to send in place of the measured ``state``, which is left alone; reused.

        Its ``tick`` is the stamp to write on it, which may be wrong.
        """
        measured = self._measured
        measured.block[:] = state.block
        self.corruption.corrupt_state(measured, state.tick)
        measured.tick = self.corruption.stamp(state.tick)
        return measured
