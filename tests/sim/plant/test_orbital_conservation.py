"""Energy and angular momentum about the Earth of a robot whose arm moves freely in orbit.

What is conserved is the sum over all bodies, at R + d_i, with the gravity of their extent. It is
compared after subtracting what a particle has at the orbit's point, see `earth_totals`: so it can
be seen that what the turning of the robot gains from gravity is lost by its orbit.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from orbiting_robots import (
    ANGLES_DEG,
    NO_FRICTION,
    EarthTotals,
    angular_momentum,
    coast,
    earth_totals,
    orbiting_plant,
    set_motion,
)
from paths import CONFIG

from space_robot_model.robot import Robot
from space_robot_sim.plant.plant import Plant

Array = NDArray[np.float64]

ROBOT = Robot.from_yaml(CONFIG / "robots/paper.yaml")
ORBIT_S = 5600.0
RATE = 0.003
"""rad/s, of base and joints."""
CIRCULAR: dict[str, Any] = {
    "height": 400e3,
    "inclination_deg": 51.6,
    "raan_deg": 30.0,
    "anomaly_deg": 20.0,
}
ECCENTRIC: dict[str, Any] = {**CIRCULAR, "height": 800e3, "eccentricity": 0.05}


def moving(period: float, elements: dict[str, Any], j2: bool) -> Plant:
    """Return the paper's robot, some metres from the orbit's point, all in motion."""
    plant = orbiting_plant(
        ROBOT,
        period,
        initial_joints_deg=ANGLES_DEG,
        initial_quaternion=[0.3, -0.8, 0.4, 0.2],
        friction=NO_FRICTION,
        gravity={"gradient": True, "j2": j2},
        orbital_elements=elements,
    )
    set_motion(
        plant,
        position=[3.0, -2.0, 1.0],
        velocity=[0.003, 0.002, -0.001],
        omega=RATE * np.array([1.0, -0.7, 0.4]),
        joint_rates=RATE * np.array([0.3, -0.5, 0.4, -0.6, 0.2, 0.8]),
    )
    return plant


def flown(
    period: float, duration: float, elements: dict[str, Any], j2: bool
) -> tuple[list[EarthTotals], Array]:
    """Return the totals at the ends of ten parts of a flight, and the momenta about the CoM."""
    plant = moving(period, elements, j2)
    totals, spins = [], []
    for part in range(11):
        if part:
            coast(plant, round(duration / period / 10))
        totals.append(earth_totals(ROBOT, plant.truth, j2))
        spins.append(angular_momentum(ROBOT, plant.truth))
    return totals, np.array(spins)


def drift(values: list[Any]) -> Array:
    """Return the largest change from the first value."""
    return np.abs(np.array(values) - values[0]).max(axis=0)


@pytest.mark.parametrize("elements", [CIRCULAR, ECCENTRIC], ids=["circular", "eccentric"])
@pytest.mark.parametrize("j2", [False, True], ids=["kepler", "j2"])
def test_energy_and_angular_momentum_about_the_earth_are_conserved(
    j2: bool, elements: dict[str, Any]
) -> None:
    """Over an orbit: with J2 the component about the Earth's axis alone."""
    totals, spins = flown(0.25, ORBIT_S, elements, j2)
    energy, angular = drift([t.energy for t in totals]), drift([t.angular for t in totals])
    assert energy < 1e-9 * abs(totals[0].energy)
    assert drift(list(spins)).max() > 1.0, "gravity turns the robot"
    exchanged = angular[2:] if j2 else angular
    assert exchanged.max() < 1e-3, "and takes from the orbit what it gives"
    if j2:
        assert angular[:2].min() > 1e3
    whole = [float(t.whole_energy / totals[0].whole_energy - 1) for t in totals]
    about_axis = [float(t.whole_angular[2] / totals[0].whole_angular[2] - 1) for t in totals]
    assert np.abs(whole).max() < 1e-12
    assert np.abs(about_axis).max() < 1e-12


def test_what_is_lost_is_the_integrators() -> None:
    """Half the step, a sixteenth of the error."""
    errors = []
    for period in (1.0, 0.5):
        totals, _ = flown(period, 1000.0, CIRCULAR, True)
        errors.append(
            [float(drift([t.energy for t in totals])), drift([t.angular[2] for t in totals])]
        )
    np.testing.assert_allclose(np.array(errors[0]) / errors[1], 16.0, rtol=0.2)
