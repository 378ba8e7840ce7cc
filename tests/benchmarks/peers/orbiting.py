"""The satellite with its arm locked in orbit: the plant's side of a comparison.

A program beside it is given the rigid body, its facets, the orbit, air and Sun; what it computes is
all its own. Both begin with the centre of mass on the same circular orbit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from oracles import rotation_of
from oracles.orbit import body_places, centre_of_mass, whole_inertia
from robots import orbiting_plant, set_motion

from space_robot_model.robot import Robot
from space_robot_model.robot.plates import plates_of
from space_robot_sim.environment.orbit_settings import OrbitSettings

from ..kernels import plant_steps

Array = NDArray[np.float64]

SOURCES = ("gravity gradient", "drag", "sunlight")
"""Of torques, in their order in the plant's state."""
LIGHT_PRESSURE = 1368.0 / 299792458.0
"""Of the Sun at 1 AU in Basilisk, N/m2."""
ORBIT: dict[str, Any] = {
    "orbital_elements": {
        "height": 400e3,
        "inclination_deg": 51.6,
        "raan_deg": 20.0,
        "anomaly_deg": 10.0,
    },
    "atmosphere": {"density": 3.725e-12, "at_height": 400e3, "scale_height": 58.5e3},
    "sunlight": {"pressure": LIGHT_PRESSURE, "beta_angle_deg": 20.0, "noon_deg": 50.0},
}


class Facet(NamedTuple):
    """A flat surface; vectors on the base's axes, from the common centre of mass."""

    area: float
    normal: Array
    centre: Array
    drag_coefficient: float
    specular: float
    diffuse: float


@dataclass(frozen=True)
class Orbiting:
    """A robot, its arm's angles, how it turns at first, and what acts on it."""

    robot: Robot
    degrees: Array
    """(n,) of the arm's joints."""
    quaternion: Array
    omega: Array
    """(3,) of the base, on inertial axes, rad/s."""
    sources: tuple[str, ...]
    """Of `SOURCES`."""
    period: float
    """s."""

    @property
    def settings(self) -> OrbitSettings:
        """The orbit, with air and light where they act."""
        parts = {
            "orbital_elements": ORBIT["orbital_elements"],
            "gravity": {"gradient": "gravity gradient" in self.sources, "j2": False},
        }
        if "drag" in self.sources:
            parts["atmosphere"] = ORBIT["atmosphere"]
        if "sunlight" in self.sources:
            parts["sunlight"] = ORBIT["sunlight"]
        return OrbitSettings.model_validate(parts)

    @property
    def sun(self) -> Array:
        """(3,) unit vector to the Sun."""
        return OrbitSettings.model_validate(ORBIT).sun


class Moment(NamedTuple):
    """What a program tells of a tick."""

    quaternion: Array
    torques: Array
    """(3, 3) of each of `SOURCES` about the centre of mass, inertial axes, N m; 0: it is not on."""
    light: float
    """Share of the sunlight that the Earth leaves."""


class OrbitPeer(Protocol):
    """Something that flies an `Orbiting`."""

    name: str

    def fly(self, steps: int) -> Moment:
        """Fly on so many steps."""


class OurSatellite:
    """The plant; also the rigid body and the facets for the others."""

    name = "space_robot"

    def __init__(self, start: Orbiting) -> None:
        plant = self._plant = orbiting_plant(
            start.robot,
            start.period,
            initial_joints_deg=start.degrees.tolist(),
            initial_quaternion=start.quaternion.tolist(),
            **start.settings.model_dump(),
        )
        arm = centre_of_mass(start.robot, plant.truth)
        set_motion(plant, -arm, -np.cross(start.omega, arm), start.omega)
        turn = rotation_of(start.quaternion).as_matrix()
        truth = plant.truth
        self.mass = float(np.sum(start.robot.mass))
        self.inertia = turn.T @ whole_inertia(start.robot, truth) @ turn
        self.position, self.velocity = truth.orbit_position.copy(), truth.orbit_velocity.copy()
        self.facets = []
        places = body_places(start.robot, truth)
        for plate in plates_of(start.robot):
            axes, origin = places[plate.body]
            normal, centre = turn.T @ axes @ plate.normal, turn.T @ (origin + axes @ plate.centre)
            optics = plate.drag_coefficient, plate.specular, plate.diffuse
            self.facets.append(Facet(plate.area, normal, centre, *optics))
        self._nothing = np.zeros(len(plant.names.commanded))
        self._tick = 0

    def fly(self, steps: int) -> Moment:
        plant = self._plant
        buffer, period = plant.command_delay_buffer, plant.period
        plant_steps(plant.block, buffer, self._nothing, self._tick, steps, period)
        self._tick += steps
        truth, surfaces = plant.truth, plant.memory.environment.surfaces
        torques = truth.external_torques[:9].reshape(3, 3).copy()
        return Moment(truth.quaternion.copy(), torques, float(np.any(surfaces.sunlight)))


def angle_apart(one: Array, other: Array) -> float:
    """Return the angle between two attitudes, rad."""
    return float((rotation_of(one).inv() * rotation_of(other)).magnitude())
