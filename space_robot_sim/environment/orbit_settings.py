"""Settings of the orbital environment: where the robot is, and what acts on it there."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError

from .gravity import EARTH_RADIUS

Degrees = Annotated[float, Field(ge=-360.0, le=360.0)]
FARTHEST = 1e9
"""Largest height, m."""


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
    def _stays_outside(self) -> Self:
        perigee = self.semi_major_axis * (1.0 - self.eccentricity) - EARTH_RADIUS
        if self.height and perigee <= 0.0:
            most = self.height / self.semi_major_axis
            raise ValueError(
                f"the perigee must be outside the Earth, with height {self.height:g} and "
                f"eccentricity {self.eccentricity:g} its height is {perigee:g} m: height is that "
                f"of the semi-major axis, with which the eccentricity must be below {most:.3g}"
            )
        return self


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
    def has_surfaces(self) -> bool:
        """True if air or sunlight act on the robot."""
        return self.has_orbit and (self.atmosphere.density > 0.0 or self.sunlight.pressure > 0.0)

    def check_orbit(self, where: str) -> None:
        """Check that nothing is set that needs an orbit, unless there is one.

        Args:
            where: name of the source, for errors.

        Raises:
            InputError: something is set, names its key.
        """
        for key in OrbitSettings.model_fields if not self.has_orbit else ():
            if getattr(self, key) != OrbitSettings.model_fields[key].default:
                raise InputError(
                    f"{where}: {key}: without an orbit it has no effect: choose an orbit, or set "
                    "orbital_elements.height, which is 0 (no orbit)"
                )
