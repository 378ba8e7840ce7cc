"""Flights in orbit: their bags, the momentum in their logs, and eight of them in lanes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run
from conservation import momentum
from numpy.typing import NDArray
from orbiting_robots import centre_of_mass

import space_robot as sr
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import ORBIT_FIELDS
from space_robot_sim.plant.surroundings import REPORT_TICKS

Array = NDArray[np.float64]

DURATION_S = 0.7


def plan_of(**options: Any) -> FlightPlan:
    return FlightPlan.model_validate({"orbit": "iss", "duration": DURATION_S, **options})


def flown(bag: Path | None = None, **options: Any) -> tuple[Flight, FlightLog]:
    flight = Flight(resolve(plan_of(**options)))
    return flight, simulate(flight, bag)


@pytest.mark.parametrize("sensors", ["ideal", "fine"])
def test_a_bag_has_the_orbit_to_the_bit(space_robot: Run, tmp_path: Path, sensors: str) -> None:
    """Where the sensors tell the truth, and where it is recorded apart."""
    bag = tmp_path / "bag"
    options = ["--orbit", "iss", "--sensors", sensors, "--duration", str(DURATION_S)]
    ran = space_robot("simulate", *options, "--bag", str(bag), "--json")
    assert ran.code == 0, ran.err
    json.loads(ran.out)
    recorded = sr.load_bag(bag)
    _, log = flown(sensors=sensors)
    for name in (*ORBIT_FIELDS, "base_position", "quaternion", "omega_base"):
        column = getattr(log, name)
        assert column.shape[1] > 0
        assert np.isfinite(column).all()
        assert (np.ptp(column, axis=0) > 0.0).any()
        np.testing.assert_array_equal(getattr(recorded, name), column, name)
    travelled = np.linalg.norm(log.orbit_position[-1] - log.orbit_position[0])
    speed = np.linalg.norm(log.orbit_velocity[0])
    assert travelled == pytest.approx(speed * log.time[-1], rel=1e-6)
    sources = log.external_torques.reshape(-1, 4, 3)
    assert (np.abs(sources[:, :3]).max(axis=(0, 2)) > 1e-7).all()


def test_a_flight_without_an_orbit_tells_nothing_of_one(tmp_path: Path) -> None:
    _, log = flown(tmp_path / "bag", orbit="none", duration=0.05)
    for name in ORBIT_FIELDS:
        assert getattr(log, name).shape == (log.ticks, 0)
        assert getattr(sr.load_bag(tmp_path / "bag"), name).shape == (log.ticks, 0)


@pytest.mark.parametrize("sensors", ["ideal", "fine"])
def test_wheels_and_robot_together_get_what_the_torques_told_give(sensors: str) -> None:
    """The angular momentum about the centre of mass grows by the integral of the four columns.

    Those of air, light and field are held over a tick, that of gravity changes all the time.
    """
    orbit = {
        "orbital_elements": {"height": 420e3, "inclination_deg": 51.6, "anomaly_deg": 30.0},
        "atmosphere": {"density": 3e-12, "at_height": 420e3},
        "sunlight": {"pressure": 4.56e-6},
        "magnetism": {"strength": 2.98e-5, "residual_dipole": [1.0, -2.0, 3.0]},
    }
    ticks = 1201
    flight, log = flown(orbit=orbit, actuators="wheels", sensors=sensors)
    assert log.ticks >= ticks
    robot, wheels = flight.plant.robot, flight.plant_settings.wheels

    def about_com(tick: int) -> Array:
        state = log.state(tick)
        linear, angular = momentum(robot, state, wheels)
        return np.asarray(angular - np.cross(centre_of_mass(robot, state), linear))

    period = log.timebase.period
    change = about_com(ticks - 1) - about_com(0)
    gravity, *others = np.split(log.external_torques[:ticks], 4, axis=1)
    impulses = [np.trapezoid(gravity[::REPORT_TICKS], dx=REPORT_TICKS * period, axis=0)]
    impulses += [period * torque[: ticks - 1].sum(axis=0) for torque in others]
    total = np.sum(impulses, axis=0)
    for impulse in impulses:
        assert np.linalg.norm(impulse) > 1e-3 * np.linalg.norm(total)
    np.testing.assert_allclose(change, total, rtol=0, atol=1e-6 * np.linalg.norm(total))


@pytest.mark.filterwarnings("ignore:the start")
@pytest.mark.parametrize("hardware", ["ideal", "wheels"])
def test_eight_flights_in_lanes_have_the_bits_of_each_alone(hardware: str) -> None:
    """In orbits that differ in every number, and one flight that is in none."""

    def scenarios() -> list[sr.Scenario]:
        common: dict[str, Any] = {"duration": 0.05, "actuators": hardware, "sensors": "fine"}
        orbits: list[Any] = ["iss", "sso_700", "gto", "none"]
        orbits += [
            {
                "orbital_elements": {
                    "height": 500e3 + 1e5 * k,
                    "eccentricity": 0.01 * k,
                    "inclination_deg": 20.0 * k,
                    "anomaly_deg": 50.0 * k,
                },
                "atmosphere": {"density": 1e-12 * k, "scale_height": 5e4 + 1e3 * k},
                "sunlight": {"pressure": 1e-6 * k, "beta_angle_deg": 10.0 * k},
                "magnetism": {"strength": 1e-5 * k, "residual_dipole": [0.1 * k, 0.2, 0.3]},
            }
            for k in range(1, 7)
        ]
        return [sr.Scenario(**common, orbit=orbit, seed=k) for k, orbit in enumerate(orbits)]

    flights = sr.fly_many(scenarios())
    for flight, scenario in zip(flights, scenarios(), strict=True):
        alone = scenario.fly()
        assert flight.outcome == alone.outcome
        columns = alone.log.columns
        assert set(ORBIT_FIELDS) <= set(columns)
        for name, column in columns.items():
            assert flight.log.columns[name].tobytes() == column.tobytes(), name
