"""What flight software knows of its orbit, and its own propagation of it.

It is the knowledge of navigation, not the truth: the epoch's state may be wrong, and neither air
nor sunlight is known. The Sun does not move during a flight.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

from .elements import Degrees, ElementSettings

Array = NDArray[np.float64]

Distance = Annotated[float, Field(ge=-1e6, le=1e6)]
Speed = Annotated[float, Field(ge=-1e3, le=1e3)]
Distances = Annotated[list[Distance], Field(min_length=3, max_length=3)]
Speeds = Annotated[list[Speed], Field(min_length=3, max_length=3)]


class OrbitErrors(StrictModel):
    """Errors of the assumed state at tick 0, added to that of the elements."""

    radial: Distance = Field(0.0, description="error of the position outwards, m")
    along: Distance = Field(
        0.0, description="error of the position along the path, in the plane of the orbit, m"
    )
    normal: Distance = Field(0.0, description="error of the position along the orbit's normal, m")
    radial_velocity: Speed = Field(0.0, description="error of the velocity outwards, m/s")
    along_velocity: Speed = Field(0.0, description="error of the velocity along the path, m/s")
    normal_velocity: Speed = Field(
        0.0, description="error of the velocity along the orbit's normal, m/s"
    )


class AssumedTarget(StrictModel):
    """The target as flight software knows it: a body that falls freely beside the robot."""

    name: str = Field("", max_length=80, description="name of the target (empty: none is known)")
    position: Distances = Field(
        [0.0, 0.0, 0.0],
        description="position of the target's centre of mass at tick 0 from the origin of the "
        "inertial frame, on its axes, m",
    )
    velocity: Speeds = Field(
        [0.0, 0.0, 0.0],
        description="its velocity then, relative to the reference point, on inertial axes, m/s",
    )


class AssumedOrbit(StrictModel):
    """The orbit that flight software knows: elements at tick 0, Sun, target, errors."""

    orbital_elements: ElementSettings = ElementSettings()
    j2: bool = Field(True, description="the propagation knows the oblateness of the Earth")
    beta_angle_deg: Annotated[float, Field(ge=-90.0, le=90.0)] = Field(
        0.0, description="angle of the Sun above the plane of the orbit at tick 0, degrees"
    )
    noon_deg: Degrees = Field(
        0.0, description="angle in the orbit, from the ascending node, at which it is noon, degrees"
    )
    errors: OrbitErrors = OrbitErrors()
    target: AssumedTarget = AssumedTarget()

    @property
    def has_orbit(self) -> bool:
        """True if flight software knows of an orbit."""
        return self.orbital_elements.height > 0.0


class Motion(NamedTuple):
    """Position and its derivatives, each (T, 3), inertial axes."""

    position: Array
    """m."""
    velocity: Array
    """m/s."""
    acceleration: Array
    """m/s2."""
    jerk: Array
    """m/s3."""


class Ephemeris:
    """Position of the reference point, and of the target, over time: flight software's own."""

    def __init__(self, assumed: AssumedOrbit) -> None:
        """Begin at tick 0; the orbit is propagated as far as it is asked for.

        Args:
            assumed: with an orbit.
        """
        self.assumed = assumed
        """As given."""
        self.sun: Array = np.zeros(3)
        """(3,) unit vector to the Sun, inertial axes."""

    @property
    def has_target(self) -> bool:
        """True if a target is known."""
        return bool(self.assumed.target.name)

    def motion(self, time: Array) -> Motion:
        """Return the motion of the reference point from the Earth's centre.

        Args:
            time: (T,) s from tick 0; earlier times count as 0.
        """
        raise NotImplementedError

    def target_motion(self, time: Array) -> Motion:
        """Return the motion of the target from the reference point, at times (T,), s."""
        raise NotImplementedError
