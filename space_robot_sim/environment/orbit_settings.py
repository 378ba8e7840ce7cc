"""Settings of the orbital environment: where the robot is, and what acts on it there."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.orbit.elements import FARTHEST, Degrees, ElementSettings, sun_of
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError


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
    def sun(self) -> NDArray[np.float64]:
        """(3,) unit vector to the Sun, inertial axes."""
        light = self.sunlight
        return sun_of(self.orbital_elements, light.beta_angle_deg, light.noon_deg)

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
