"""Keplerian elements of an orbit about the Earth, and the directions that follow from them."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.validation import StrictModel

from ..elementary.matrices import Array, norm
from ..elementary.rotations import plain_sin_cos

MU = 3.986004418e14
"""Gravitational parameter of the Earth, m3/s2."""
EARTH_RADIUS = 6378137.0
"""Equatorial radius of the Earth, m (WGS 84)."""
J2 = 1.08262668e-3
"""Second zonal harmonic of the Earth (EGM96)."""
OBLATENESS = 1.5 * J2 * MU * EARTH_RADIUS * EARTH_RADIUS
"""m5/s2."""
TO_RAD = math.pi / 180.0
FARTHEST = 1e9
"""Largest height, m."""
Degrees = Annotated[float, Field(ge=-360.0, le=360.0)]


class ElementSettings(StrictModel):
    """Orbit of the reference point at tick 0; positions of the robot are relative to that point."""

    height: Annotated[float, Field(ge=0.0, le=FARTHEST)] = Field(
        0.0, description="semi-major axis less the Earth's radius of 6378137 m, m (0: no orbit)"
    )
    eccentricity: Annotated[float, Field(ge=0.0, lt=1.0)] = Field(0.0, description="eccentricity")
    inclination_deg: Annotated[float, Field(ge=0.0, le=180.0)] = Field(
        0.0, description="inclination to the equator, degrees"
    )
    raan_deg: Degrees = Field(0.0, description="right ascension of the ascending node, degrees")
    perigee_deg: Degrees = Field(0.0, description="argument of perigee, degrees")
    anomaly_deg: Degrees = Field(0.0, description="mean anomaly at tick 0, degrees")

    @property
    def semi_major_axis(self) -> float:
        """Half the longest diameter of the orbit, m."""
        return EARTH_RADIUS + self.height

    @model_validator(mode="after")
    def _check_perigee(self) -> Self:
        perigee = self.semi_major_axis * (1.0 - self.eccentricity) - EARTH_RADIUS
        if self.height and perigee <= 0.0:
            most = self.height / self.semi_major_axis
            raise ValueError(
                f"the perigee must be outside the Earth, with height {self.height:g} and "
                f"eccentricity {self.eccentricity:g} its height is {perigee:g} m: height is that "
                f"of the semi-major axis, with which the eccentricity must be below {most:.3g}"
            )
        return self


def orbit_plane(elements: ElementSettings) -> tuple[Array, Array, Array]:
    """Return the unit vectors to the ascending node, 90 degrees ahead of it, and of the normal."""
    s, c = plain_sin_cos(elements.raan_deg * TO_RAD)
    si, ci = plain_sin_cos(elements.inclination_deg * TO_RAD)
    return (np.array([c, s, 0.0]), np.array([-s * ci, c * ci, si]), np.array([s * si, -c * si, ci]))


def state_of(elements: ElementSettings) -> tuple[Array, Array]:
    """Return position, m, and velocity, m/s, by Kepler's equation."""
    e, a = elements.eccentricity, elements.semi_major_axis
    mean = math.remainder(elements.anomaly_deg * TO_RAD, 2.0 * math.pi)
    # Newton's method from pi converges for any eccentricity
    anomaly = mean if e < 0.8 else math.copysign(math.pi, mean)
    for _ in range(50):
        s, c = plain_sin_cos(anomaly)
        anomaly -= (anomaly - e * s - mean) / (1.0 - e * c)
    s, c = plain_sin_cos(anomaly)
    root = math.sqrt(1.0 - e * e)
    rate = math.sqrt(MU / a) / (1.0 - e * c)
    along, across = a * (c - e), a * root * s
    v_along, v_across = -rate * s, rate * root * c
    sp, cp = plain_sin_cos(elements.perigee_deg * TO_RAD)
    node, ahead, _ = orbit_plane(elements)
    p, q = cp * node + sp * ahead, cp * ahead - sp * node
    return along * p + across * q, v_along * p + v_across * q


def hill_axes(position: Array, velocity: Array) -> Array:
    """Return the axes of an orbit as columns (3, 3): radial, along the path, along the normal.

    Args:
        position: (3,) from the Earth's centre, m.
        velocity: (3,) m/s.
    """
    radial, normal = position / norm(position), np.cross(position, velocity)
    normal = normal / norm(normal)
    return np.column_stack([radial, np.cross(normal, radial), normal])


def sun_of(elements: ElementSettings, beta_angle_deg: float, noon_deg: float) -> Array:
    """Return the unit vector (3,) to the Sun, inertial axes.

    Args:
        elements: of the orbit.
        beta_angle_deg: angle of the Sun above the plane of the orbit at tick 0, degrees.
        noon_deg: angle in the orbit, from the ascending node, at which it is noon, degrees.
    """
    node, ahead, normal = orbit_plane(elements)
    s, c = plain_sin_cos(noon_deg * TO_RAD)
    sb, cb = plain_sin_cos(beta_angle_deg * TO_RAD)
    direction: Array = cb * (c * node + s * ahead) + sb * normal
    return direction
