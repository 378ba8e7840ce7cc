"""The data sheet of on-off thrusters and their tank."""

from __future__ import annotations

from functools import partial
from typing import Annotated, ClassVar

import numpy as np
from pydantic import AfterValidator, Field

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_THRUSTERS

from ..elementary.matrices import Array
from .sheets import (
    FEWEST,
    NO_VECTORS,
    MountedSheet,
    Positive,
    Vectors,
    are_directions,
    are_vectors,
    directions,
    vectors,
)

STANDARD_GRAVITY = 9.80665
"""m/s2."""
PER_THRUSTER = "one value for all thrusters, or one per thruster"
Positions = Annotated[Vectors, AfterValidator(partial(are_vectors, most=MOST_THRUSTERS))]
Directions = Annotated[Vectors, AfterValidator(partial(are_directions, most=MOST_THRUSTERS))]
Times = Annotated[list[Annotated[float, Field(ge=0.0, le=1.0)]], FEWEST]


class ThrusterSettings(MountedSheet):
    """Thrusters on the base, fed from one tank; by default none."""

    section: ClassVar[str] = "thrusters"

    positions: Positions = Field(
        NO_VECTORS,
        description="positions from the base's CoM, in the base frame, m: x, y, z of each "
        "thruster, one behind the other ([0.0]: no thrusters)",
    )
    directions: Directions = Field(
        NO_VECTORS,
        description="directions of the force on the base, in the base frame: x, y, z of each "
        "thruster, one behind the other",
    )
    force: Positive = Field([1.0], description=f"force of an open thruster, N; {PER_THRUSTER}")
    shortest_pulse: Times = Field(
        [0.0],
        description="shortest time for which a valve is open, s, rounded to a whole number of "
        f"ticks; {PER_THRUSTER}",
    )
    delay: Times = Field(
        [0.0],
        description="delay from the command to the valve, s, rounded to a whole number of ticks; "
        f"{PER_THRUSTER}",
    )
    specific_impulse: Positive = Field([220.0], description=f"specific impulse, s; {PER_THRUSTER}")
    propellant: Annotated[float, Field(ge=0.0, le=1e9)] = Field(
        0.0, description="propellant in the tank at tick 0, kg (0: unlimited)"
    )

    @property
    def places(self) -> Array:
        """(T, 3) positions relative to the base's CoM, m, base frame."""
        return vectors(self.positions)

    @property
    def unit_directions(self) -> Array:
        """(T, 3) unit vectors of the forces on the base, base frame."""
        return directions(self.directions)

    @property
    def torques(self) -> Array:
        """(T, 3) torque of each open thruster about the base's CoM, N m, in the base frame."""
        forces = self.unit_directions * self.values("force")[:, None]
        return np.asarray(np.cross(self.places, forces), dtype=np.float64)

    @property
    def mass_flow(self) -> Array:
        """(T,) mass flow of each open thruster, ``F / (I_sp g_0)``, kg/s."""
        impulse = self.values("specific_impulse") * STANDARD_GRAVITY
        flow: Array = self.values("force") / impulse
        return flow

    def ticks(self, name: str, period: float) -> Array:
        """Return the times of the setting ``name`` in whole ticks of ``period``, s, (T,)."""
        return np.round(self.values(name) / period)

    def check(self) -> None:
        """Check that the settings are consistent."""
        pointed = len(vectors(self.directions))
        if pointed != self.count:
            raise InputError(
                f"thrusters.directions are for {pointed} thrusters, thrusters.positions for "
                f"{self.count}"
            )
        for name in ("force", "shortest_pulse", "delay", "specific_impulse"):
            if self.count:
                self.values(name)
