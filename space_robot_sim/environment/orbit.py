"""Orbit of the point that the robot's positions are relative to, and what it meets there.

The point falls freely from its Keplerian elements at tick 0; it is integrated with the robot, since
J2 makes its orbit none of Kepler's. A file of config/orbits has nothing but the settings of an
orbit.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.dynamics.algebra import Vector, add, dot, scale, store, subtract, vector
from space_robot_model.elementary.functions import sin_cos
from space_robot_model.elementary.rotations import plain_sin_cos
from space_robot_model.orbit.elements import (
    EARTH_RADIUS,
    FARTHEST,
    TO_RAD,
    Degrees,
    ElementSettings,
    state_of,
    sun_of,
)
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import where
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.config.files import named_layers, node_parameters
from space_robot_msgs_py.config.text import printable
from space_robot_msgs_py.config.validation import StrictModel, read_yaml, validate
from space_robot_msgs_py.errors import InputError

from ..component import Component

Array = NDArray[np.float64]

EARTH_RATE = 7.292115e-5
"""Angular velocity of the Earth, rad/s."""
NODE, NO_ORBIT = "plant", "none"
SECTIONS = ("plant_node", "/plant_node", "/**", "/**/plant_node")
"""Keys of a parameter file that are read by the plant."""


class GravitySettings(StrictModel):
    """Gravity in orbit."""

    gradient: bool = Field(True, description="gravity gradient on every body of the robot")
    j2: bool = Field(True, description="oblateness of the Earth")


class AtmosphereSettings(StrictModel):
    """Exponential atmosphere that turns with the Earth."""

    density: Annotated[float, Field(ge=0.0, le=10.0)] = Field(
        0.0, description="density at at_height, kg/m3 (0: no atmosphere)"
    )
    at_height: Annotated[float, Field(ge=0.0, le=FARTHEST)] = Field(
        400e3, description="height of density above the Earth's equatorial radius, m"
    )
    scale_height: Annotated[float, Field(ge=1e3, le=1e6)] = Field(
        58.5e3, description="height over which the density falls by a factor of e, m"
    )


class SunlightSettings(StrictModel):
    """Sunlight, whose direction does not change during a flight."""

    pressure: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        0.0, description="pressure of sunlight, N/m2, 4.56e-6 at the Earth (0: none)"
    )
    beta_angle_deg: Annotated[float, Field(ge=-90.0, le=90.0)] = Field(
        0.0, description="angle of the Sun above the plane of the orbit at tick 0, degrees"
    )
    noon_deg: Degrees = Field(
        0.0, description="angle in the orbit, from the ascending node, at which it is noon, degrees"
    )


class MagnetismSettings(StrictModel):
    """Magnetic field of the Earth, a tilted dipole that turns with it."""

    strength: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        0.0, description="field on the surface at the magnetic equator, 2.971e-5 T (0: none)"
    )
    tilt_deg: Annotated[float, Field(ge=0.0, le=180.0)] = Field(
        9.41, description="angle between the dipole's and the Earth's axis, degrees"
    )
    pole_deg: Degrees = Field(
        -72.68, description="right ascension of the northern magnetic pole at tick 0, degrees"
    )
    residual_dipole: Annotated[
        list[Annotated[float, Field(ge=-1e6, le=1e6)]], Field(min_length=3, max_length=3)
    ] = Field([0.0, 0.0, 0.0], description="magnetic moment of the base, base axes, A m2")


class OrbitSettings(StrictModel):
    """Settings of the orbital environment, as in a file of config/orbits."""

    orbital_elements: ElementSettings = ElementSettings()
    gravity: GravitySettings = GravitySettings()
    atmosphere: AtmosphereSettings = AtmosphereSettings()
    sunlight: SunlightSettings = SunlightSettings()
    magnetism: MagnetismSettings = MagnetismSettings()

    @property
    def has_orbit(self) -> bool:
        """True if the robot is in an orbit."""
        return self.orbital_elements.height > 0.0

    @property
    def sun(self) -> Array:
        """(3,) unit vector to the Sun, inertial axes."""
        light = self.sunlight
        return sun_of(self.orbital_elements, light.beta_angle_deg, light.noon_deg)

    @property
    def has_surfaces(self) -> bool:
        """True if air or sunlight act on the robot."""
        return self.has_orbit and (self.atmosphere.density > 0.0 or self.sunlight.pressure > 0.0)

    def check_orbit(self, where: str) -> None:
        """Check that nothing is set that needs an orbit, unless there is one.

        ``where`` names the source in errors.
        """
        for key in OrbitSettings.model_fields if not self.has_orbit else ():
            if getattr(self, key) != OrbitSettings.model_fields[key].default:
                raise InputError(
                    f"{where}: {key}: without an orbit it has no effect: choose an orbit, or set "
                    "orbital_elements.height, which is 0 (no orbit)"
                )


def orbit_layers(name: str) -> list[Path]:
    """Return the checked file of an orbit (of config/orbits, or a path) in a list; [] for none."""
    paths = [] if name == NO_ORBIT else named_layers("orbits", name)
    for path in paths:
        _check_file(path)
    return paths


def _check_file(path: Path) -> None:
    for key in read_yaml(path):
        if key in OrbitSettings.model_fields:
            raise InputError(
                f"{path}: {key}: it belongs into plant_node: {{ros__parameters: {{{key}: ...}}}}"
            )
        if key not in SECTIONS:
            raise InputError(
                f"{path}: {printable(str(key))}: an orbit has parameters of plant_node, and of no "
                "other node"
            )
    validate(OrbitSettings, node_parameters(path, NODE), str(path)).check_orbit(str(path))


class Orbit(Component):
    """The orbital environment of a robot."""

    is_on: float = shaped(lambda n: (), uniform=True, source="has_orbit")
    """1 in an orbit; 0: nothing of this acts."""
    has_gradient: float = shaped(lambda n: (), uniform=True, source="gravity.gradient")
    has_j2: float = shaped(lambda n: (), uniform=True, source="gravity.j2")
    position: Array = shaped(lambda n: (3,), source=lambda s, at: state_of(s.orbital_elements)[0])
    """Position of the reference point at tick 0 from the Earth's centre, m, inertial axes."""
    velocity: Array = shaped(lambda n: (3,), source=lambda s, at: state_of(s.orbital_elements)[1])
    """Its velocity then, m/s."""
    density: float = shaped(lambda n: (), source="atmosphere.density")
    """kg/m3 at ``at_height``."""
    at_height: float = shaped(lambda n: (), source="atmosphere.at_height")
    """m."""
    scale_height: float = shaped(lambda n: (), source="atmosphere.scale_height")
    """m."""
    sun: Array = shaped(lambda n: (3,), source="sun")
    """Unit vector to the Sun."""
    pressure: float = shaped(lambda n: (), source="sunlight.pressure")
    """N/m2."""
    strength: float = shaped(lambda n: (), source="magnetism.strength")
    """Magnetic field on the surface at the magnetic equator, T."""
    tilt: Array = shaped(
        lambda n: (2,), source=lambda s, at: plain_sin_cos(s.magnetism.tilt_deg * TO_RAD)
    )
    """Sine and cosine of the dipole's tilt."""
    pole: float = shaped(lambda n: (), source=lambda s, at: s.magnetism.pole_deg * TO_RAD)
    """Right ascension of the northern magnetic pole at tick 0, rad."""
    residual_dipole: Array = shaped(lambda n: (3,), source="magnetism.residual_dipole")
    """A m2, base axes."""
    wind: Array = shaped(lambda n: (3,))
    """Velocity of the base against the air at the present tick, m/s, inertial axes."""
    field: Array = shaped(lambda n: (3,))
    """Magnetic field at the present tick, T, inertial axes."""
    magnetic_torque: Array = shaped(lambda n: (3,))
    """On the base over the present tick, N m, base axes."""

    @staticmethod
    def is_fitted(sheet: OrbitSettings) -> bool:
        """Return whether there is an orbit."""
        return sheet.has_orbit


@kernel
def density_at(orbit: Orbit, distance: float) -> float:
    """Return the density, kg/m3, at a distance from the Earth's centre, m."""
    exponent = -(distance - EARTH_RADIUS - orbit.at_height) / orbit.scale_height
    exponent = max(min(exponent, 700.0), -700.0)
    # exp(x / 1024) by its series, squared ten times: the same operations for one flight and for
    # eight; the error is below 1e-12
    y = exponent / 1024.0
    power, term = 1.0, 1.0
    for k in range(1, 16):
        term = term * y / k
        power = power + term
    for _ in range(10):
        power = power * power
    return orbit.density * power


@kernel
def magnetic_field(orbit: Orbit, position: Array, time: float, out: Array) -> None:
    """Write the magnetic field at ``position`` (3,), m, into ``out`` (3,), T, inertial axes.

    A dipole with its southern magnetic pole in the north: ``B (R / r)^3 (3 (g . u) u - g)``.
    """
    s, c = sin_cos(orbit.pole + EARTH_RATE * time)
    north = (orbit.tilt[0] * c, orbit.tilt[0] * s, orbit.tilt[1])
    r = vector(position, 0)
    distance = np.sqrt(dot(r, r))
    u, ratio = scale(r, 1.0 / distance), EARTH_RADIUS / distance
    # minus: the pole in the north is the southern one of a magnet
    size = -orbit.strength * ratio * ratio * ratio
    store(scale(subtract(scale(u, 3.0 * dot(north, u)), north), size), out, 0)


@subroutine
def wind(position: Vector, velocity: Vector) -> Vector:
    """Return the velocity against the air, which turns with the Earth, m/s."""
    return add(velocity, (EARTH_RATE * position[1], -EARTH_RATE * position[0], 0.0))


@subroutine
def light(orbit: Orbit, position: Vector) -> float:
    """Return 1 in the sunlight, 0 in the Earth's cylindrical shadow."""
    sun = vector(orbit.sun, 0)
    along = dot(position, sun)
    off = subtract(position, scale(sun, along))
    is_dark = (along < 0.0) & (dot(off, off) < EARTH_RADIUS * EARTH_RADIUS)
    return where(is_dark, 0.0, 1.0)
