"""Orbit of the point that the robot's positions are relative to, and what it meets there.

The point falls freely from its Keplerian elements at tick 0; it is integrated with the robot, since
J2 makes its orbit none of Kepler's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import Vector, add, dot, scale, store, subtract, vector
from space_robot_model.elementary.functions import sin_cos
from space_robot_model.elementary.rotations import plain_sin_cos
from space_robot_model.orbit.elements import EARTH_RADIUS, TO_RAD, state_of
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import where
from space_robot_msgs_py.compiled.records import Record, assign, shaped

from .orbit_settings import OrbitSettings

Array = NDArray[np.float64]

EARTH_RATE = 7.292115e-5
"""Angular velocity of the Earth, rad/s."""


class Orbit(Record):
    """The orbital environment of a robot."""

    is_on: float = shaped(lambda n: (), uniform=True)
    """1 in an orbit; 0: nothing of this acts."""
    has_gradient: float = shaped(lambda n: (), uniform=True)
    has_j2: float = shaped(lambda n: (), uniform=True)
    position: Array = shaped(lambda n: (3,))
    """Position of the reference point at tick 0 from the Earth's centre, m, inertial axes."""
    velocity: Array = shaped(lambda n: (3,))
    """Its velocity then, m/s."""
    density: float = shaped(lambda n: ())
    """kg/m3 at ``at_height``."""
    at_height: float = shaped(lambda n: ())
    """m."""
    scale_height: float = shaped(lambda n: ())
    """m."""
    sun: Array = shaped(lambda n: (3,))
    """Unit vector to the Sun."""
    pressure: float = shaped(lambda n: ())
    """N/m2."""
    strength: float = shaped(lambda n: ())
    """Magnetic field on the surface at the magnetic equator, T."""
    tilt: Array = shaped(lambda n: (2,))
    """Sine and cosine of the dipole's tilt."""
    pole: float = shaped(lambda n: ())
    """Right ascension of the northern magnetic pole at tick 0, rad."""
    residual_dipole: Array = shaped(lambda n: (3,))
    """A m2, base axes."""
    wind: Array = shaped(lambda n: (3,))
    """Velocity of the base against the air at the present tick, m/s, inertial axes."""
    field: Array = shaped(lambda n: (3,))
    """Magnetic field at the present tick, T, inertial axes."""
    magnetic_torque: Array = shaped(lambda n: (3,))
    """On the base over the present tick, N m, base axes."""

    @classmethod
    def build(cls, n: int, settings: OrbitSettings) -> Orbit:
        """Read the numbers of the settings."""
        orbit = cls.allocate(n)
        if not settings.has_orbit:
            return orbit
        position, velocity = state_of(settings.orbital_elements)
        atmosphere, magnetism = settings.atmosphere, settings.magnetism
        assign(
            orbit,
            is_on=1.0,
            has_gradient=settings.gravity.gradient,
            has_j2=settings.gravity.j2,
            position=position,
            velocity=velocity,
            density=atmosphere.density,
            at_height=atmosphere.at_height,
            scale_height=atmosphere.scale_height,
            sun=settings.sun,
            pressure=settings.sunlight.pressure,
            strength=magnetism.strength,
            tilt=plain_sin_cos(magnetism.tilt_deg * TO_RAD),
            pole=magnetism.pole_deg * TO_RAD,
            residual_dipole=magnetism.residual_dipole,
        )
        return orbit


@kernel
def density_at(orbit: Orbit, distance: float) -> float:
    """Return the density, kg/m3, at a distance from the Earth's centre, m."""
    exponent = -(distance - EARTH_RADIUS - orbit.at_height) / orbit.scale_height
    exponent = max(min(exponent, 700.0), -700.0)
    # by squares, in the same operations for one flight and for eight; its error is below 1e-12
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
