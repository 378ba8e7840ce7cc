"""What flight software knows of its orbit, and its own propagation of it.

It is the knowledge of navigation, not the truth: the epoch's state may be wrong, and neither air
nor sunlight is known. The Sun does not move during a flight.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

from ..elementary.matrices import Array, product
from .elements import Degrees, ElementSettings, hill_axes, state_of, sun_of

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


class OrbitalMotion(NamedTuple):
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
    """Motion of the reference point, and of the target, over time: flight software's own."""

    def __init__(self, assumed: AssumedOrbit) -> None:
        """Begin at tick 0; the orbit is propagated as far as it is asked for.

        Args:
            assumed: with an orbit.
        """
        self.assumed = assumed
        """As given."""
        self.sun = sun_of(assumed.orbital_elements, assumed.beta_angle_deg, assumed.noon_deg)
        """(3,) unit vector to the Sun, inertial axes."""
        self.has_j2 = float(assumed.j2)
        """1 if the propagation knows the oblateness of the Earth, else 0."""
        errors, position, velocity = assumed.errors, *state_of(assumed.orbital_elements)
        axes = hill_axes(position, velocity)
        position = position + product(axes, [errors.radial, errors.along, errors.normal])
        velocity = velocity + product(
            axes, [errors.radial_velocity, errors.along_velocity, errors.normal_velocity]
        )
        start, still, target = np.zeros((1, 18)), np.zeros(3), assumed.target
        start[0] = np.concatenate(
            (position, velocity, still, target.position, target.velocity, still)
        )
        self._nodes = start

    @property
    def has_target(self) -> bool:
        """True if a target is known."""
        return bool(self.assumed.target.name)

    def nodes(self, latest: float) -> Array:
        """Return the nodes (K, 18) of the motion, at least up to ``latest``, s; see `propagate`."""
        from .propagation import STEP, propagate  # slow to import

        if latest >= (known := len(self._nodes) - 1) * STEP or not known:
            # half as many again: asked tick by tick it seldom propagates
            extended = np.empty((int(max(latest, 0.0) / STEP) + 2 + known // 2, 18))
            extended[: known + 1] = self._nodes
            propagate(extended, known + 1, self.has_j2)
            self._nodes = extended
        return self._nodes

    def motion(self, time: Array, of_target: bool = False) -> OrbitalMotion:
        """Return the motion of the reference point from the Earth's centre at times (T,), s.

        With ``of_target`` it is that of the target from the reference point. Times before tick 0
        count as 0.
        """
        from .propagation import motions_into  # slow to import

        times, out = np.ascontiguousarray(time, dtype=np.float64), np.empty((4, len(time), 3))
        nodes = self.nodes(float(times.max(initial=0.0)))
        motions_into(nodes, self.has_j2, of_target, times, out)
        return OrbitalMotion(*out)
