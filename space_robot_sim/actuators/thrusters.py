"""Thrusters on the base, each open or closed.

A thruster that is asked for more than half of its force is opened, a valve's delay later, and is
closed again at the earliest after its shortest pulse. Open thrusters burn ``F / (I_sp g_0)`` of
the tank's propellant; what is left in the tick in which it ends is shared alike.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_THRUSTERS

from ..faults.axes import About
from ..faults.grammar import Argument, Kind
from ..faults.schedule import Schedule, ScheduledFault, TemporaryChange
from .mounting import (
    FEWEST,
    NO_VECTORS,
    Positive,
    Vectors,
    are_directions,
    are_vectors,
    directions,
    values_of,
    vectors,
)

Array = NDArray[np.float64]
STANDARD_GRAVITY = 9.80665
"""m/s2."""
PER_THRUSTER = "one value for all thrusters, or one each"
Times = Annotated[list[Annotated[float, Field(ge=0.0, le=1.0)]], FEWEST]


def _positions(flat: list[float]) -> list[float]:
    return are_vectors(flat, MOST_THRUSTERS)


def _directions(flat: list[float]) -> list[float]:
    return are_directions(flat, MOST_THRUSTERS)


class ThrusterSettings(StrictModel):
    """Thrusters on the base, fed from one tank; by default none."""

    positions: Annotated[Vectors, AfterValidator(_positions)] = Field(
        NO_VECTORS,
        description="from the base's CoM, in the base frame, m: x, y, z of each thruster, one "
        "behind the other ([0.0]: no thrusters)",
    )
    directions: Annotated[Vectors, AfterValidator(_directions)] = Field(
        NO_VECTORS,
        description="of the force on the base, in the base frame: x, y, z of each thruster, one "
        "behind the other",
    )
    force: Positive = Field([1.0], description=f"of an open thruster, N; {PER_THRUSTER}")
    shortest_pulse: Times = Field(
        [0.0], description="time for which a valve stays open once it is open, s, to a whole "
        f"number of ticks; {PER_THRUSTER}",
    )  # fmt: skip
    delay: Times = Field(
        [0.0], description="time from a command to its valve, s, to a whole number of ticks; "
        f"{PER_THRUSTER}",
    )  # fmt: skip
    specific_impulse: Positive = Field(
        [220.0], description=f"impulse for a weight of propellant, s; {PER_THRUSTER}"
    )
    propellant: Annotated[float, Field(ge=0.0, le=1e9)] = Field(
        0.0, description="in the tank at tick 0, kg (0: it never runs out)"
    )

    @property
    def count(self) -> int:
        """Number of thrusters."""
        return len(vectors(self.positions))

    @property
    def places(self) -> Array:
        """(T, 3) positions from the base's CoM, m."""
        return vectors(self.positions)

    @property
    def unit_directions(self) -> Array:
        """(T, 3) unit vectors of the forces on the base."""
        return directions(self.directions)

    @property
    def torques(self) -> Array:
        """(T, 3) torque of each open thruster about the base's CoM, N m, in the base frame."""
        forces = self.unit_directions * self.values("force")[:, None]
        return np.asarray(np.cross(self.places, forces), dtype=np.float64)

    def values(self, name: str) -> Array:
        """Return (T,) values of the setting ``name``, one a thruster.

        Raises:
            InputError: it has neither one value nor one a thruster.
        """
        return values_of(getattr(self, name), f"thrusters.{name}", self.count, "thruster")

    @property
    def mass_flow(self) -> Array:
        """(T,) propellant that each open thruster burns, ``F / (I_sp g_0)``, kg/s."""
        impulse = self.values("specific_impulse") * STANDARD_GRAVITY
        flow: Array = self.values("force") / impulse
        return flow

    def ticks(self, name: str, period: float) -> Array:
        """Return the times of the setting ``name`` in whole ticks of ``period``, s, (T,)."""
        return np.round(self.values(name) / period)

    def check(self) -> None:
        """See that the numbers fit one another.

        Raises:
            InputError: they do not.
        """
        pointed = len(vectors(self.directions))
        if pointed != self.count:
            raise InputError(
                f"thrusters.directions are those of {pointed} thrusters, thrusters.positions of "
                f"{self.count}"
            )
        for name in ("force", "shortest_pulse", "delay", "specific_impulse"):
            if self.count:
                self.values(name)


class Thrusters(Record):
    """The thrusters of one base; numbers beyond the last thruster are zero."""

    count: float = shaped(lambda n: ())
    force: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Of an open thruster, N."""
    direction: Array = shaped(lambda n: (MOST_THRUSTERS, 3))
    """Unit vectors of the force on the base, base frame."""
    lever: Array = shaped(lambda n: (MOST_THRUSTERS, 3))
    """Torque about the base's CoM by force, m, base frame: position x direction."""
    flow: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Propellant that an open thruster burns, kg/s."""
    shortest_pulse: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Ticks, at least one."""
    stuck_on: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """1 for a valve that cannot be closed."""
    stuck_off: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """1 for a valve that cannot be opened, be it stuck on besides."""
    open: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """1 for a valve that was open over the last tick."""
    remaining: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Ticks for which a valve must stay open."""
    pulses: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Times so far that a valve has opened."""
    propellant: float = shaped(lambda n: ())
    """Left in the tank, kg; inf: it never runs out."""
    burnt: float = shaped(lambda n: ())
    """Propellant used so far, kg."""

    @classmethod
    def build(cls, n: int, settings: ThrusterSettings, period: float) -> Thrusters:
        """Read settings that fit one another, see `ThrusterSettings.check`, for ticks of a period.

        Args:
            n: joints of the robot.
            settings: of the thrusters.
            period: s.
        """
        thrusters, count = cls.allocate(n), settings.count
        assign(thrusters, count=count, propellant=settings.propellant or np.inf)
        if count:
            force = settings.values("force")
            thrusters.force[:count] = force
            thrusters.direction[:count] = settings.unit_directions
            thrusters.lever[:count] = settings.torques / force[:, None]
            thrusters.flow[:count] = settings.mass_flow
            ticks = settings.ticks("shortest_pulse", period)
            thrusters.shortest_pulse[:count] = np.maximum(1.0, ticks)
        return thrusters


@kernel
def fire(
    thrusters: Thrusters, asked: Array, period: float, thrusts: Array, base_wrench: Array
) -> None:
    """Open and close valves; write what they give over a tick into ``thrusts``.

    Args:
        thrusters: whose valves and tank change.
        asked: (T,) or more, force asked of each, N.
        period: of a tick, s.
        thrusts: (MOST_THRUSTERS,) N, mean over the tick, written.
        base_wrench: (6,) force, N, and torque about the CoM, N m, on base axes; theirs is added.
    """
    flow = 0.0
    for k in range(int(thrusters.count)):
        wanted = asked[k] > 0.5 * thrusters.force[k] or thrusters.remaining[k] > 0.0
        is_open = (wanted or thrusters.stuck_on[k] != 0.0) and thrusters.stuck_off[k] == 0.0
        if is_open and thrusters.open[k] == 0.0:
            thrusters.pulses[k] += 1.0
            thrusters.remaining[k] = thrusters.shortest_pulse[k]
        left = thrusters.remaining[k] - 1.0
        thrusters.remaining[k] = left if is_open and left > 0.0 else 0.0
        thrusters.open[k] = 1.0 if is_open else 0.0
        flow += thrusters.open[k] * thrusters.flow[k]
    burnt = min(flow * period, thrusters.propellant)
    share = burnt / (flow * period) if flow > 0.0 else 0.0
    thrusters.burnt += burnt
    thrusters.propellant -= burnt
    for k in range(int(thrusters.count)):
        thrust = share * thrusters.open[k] * thrusters.force[k]
        thrusts[k] = thrust
        for i in range(3):
            base_wrench[i] += thrust * thrusters.direction[k, i]
            base_wrench[3 + i] += thrust * thrusters.lever[k, i]


_THRUSTER = Argument("", "", 0.0, 0.0, about=About.THRUSTER)
THRUSTER_STUCK_ON = Kind("thruster_stuck_on", _THRUSTER, None, "a thruster's valve stays open")
THRUSTER_STUCK_OFF = Kind("thruster_stuck_off", _THRUSTER, None, "a thruster's valve stays closed")


class StuckThruster:
    """Lets some valves stay open or closed for a while."""

    KINDS: ClassVar[tuple[Kind, ...]] = (THRUSTER_STUCK_ON, THRUSTER_STUCK_OFF)

    def __init__(self, schedule: Schedule) -> None:
        self._on = TemporaryChange(schedule.of(THRUSTER_STUCK_ON))
        self._off = TemporaryChange(schedule.of(THRUSTER_STUCK_OFF))

    def apply(self, tick: int, part: Thrusters) -> None:
        """Let those be stuck that should be from ``tick`` to the next."""
        self._on.apply(tick, part.stuck_on, _stick)
        self._off.apply(tick, part.stuck_off, _stick)


def _stick(stuck: Array, fault: ScheduledFault) -> None:
    stuck[list(fault.axes)] = 1.0
