"""Whole flights that point and that start with rates: seen from the truth, not the reference."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

JOINTS = [0, 90, 200, 20, 30, 10]


def flight_of(start: Any, *segments: dict[str, Any], **options: Any) -> Flight:
    mission = {"start": {"joints_deg": JOINTS, "base": start}, "segments": list(segments)}
    return Flight(resolve(FlightPlan(mission=mission, controller="ctc", **options)))


def errors(log: FlightLog) -> Array:
    """Return the rotation from the desired to the true attitude, (N, 3) rad."""
    true, desired = (
        Rotation.from_quat(rows, scalar_first=True)
        for rows in (log.quaternion, log.reference_base[:, :4])
    )
    vectors: Array = (desired.inv() * true).as_rotvec()
    return vectors


def off_nadir(log: FlightLog) -> Array:
    """Return the angle between the base's z axis and the true direction of the Earth, rad."""
    axis = Rotation.from_quat(log.quaternion, scalar_first=True).apply([0.0, 0.0, 1.0])
    down = -log.orbit_position / np.linalg.norm(log.orbit_position, axis=1)[:, np.newaxis]
    angles: Array = np.linalg.norm(np.cross(axis, down), axis=1)
    return angles


@pytest.mark.parametrize("along_m", [0.0, 1e4])
def test_a_base_that_points_from_the_start_on_is_where_the_flight_software_believes(
    along_m: float,
) -> None:
    """An error along the path turns what is nadir by its angle; nothing has to settle."""
    flight = flight_of(
        "nadir",
        {"tool": {"xyz": [0.002, 0.0, -0.002], "frame": "orbit"}, "duration": 0.5},
        {"hold": 0.3},
        orbit="iss",
        parameters={"mission": {"assumed_orbit.errors.along": along_m}},
    )
    log = simulate(flight)
    assert np.abs(errors(log)).max() < 1e-6
    rate = np.linalg.norm(log.omega_base, axis=1)
    assert np.abs(rate - 1.1275e-3).max() < 5e-6
    np.testing.assert_allclose(off_nadir(log), along_m / 6.798e6, rtol=1e-3, atol=1e-6)


def test_an_attitude_of_the_plant_that_is_given_stays() -> None:
    own = {"plant": {"initial_quaternion": [0.0, 1.0, 0.0, 0.0]}}
    flight = flight_of("nadir", {"hold": 1}, orbit="iss", parameters=own)
    assert flight.plant_settings.initial_quaternion == [0.0, 1.0, 0.0, 0.0]
    assert flight.plant_settings.initial_rate_deg_s[1] == pytest.approx(-0.0646, abs=1e-4)


def test_a_capture_tells_where_the_target_is() -> None:
    options = {"orbit": "iss", "events": ["capture@15:neighbouring_satellite"]}
    flight = flight_of({"point": "target"}, {"hold": 15}, duration=0.2, **options)
    target = flight.mission_settings.assumed_orbit.target
    assert target.name
    log = simulate(flight)
    axis = Rotation.from_quat(log.quaternion[0], scalar_first=True).apply([0.0, 0.0, 1.0])
    place = np.array(target.position)
    np.testing.assert_allclose(axis, place / np.linalg.norm(place), atol=1e-9)
    assert np.abs(errors(log)).max() < 1e-6


@pytest.mark.parametrize("rpy_deg", [[0, 0, 0], [20, -70, 175]])
def test_navigation_begins_right_at_any_attitude_and_rate(rpy_deg: list[float]) -> None:
    """The reference begins with the rate, so an error is the estimate's: the tracker's noise."""
    flight = flight_of(
        {"rpy_deg": rpy_deg, "rate_deg_s": [0.5, -0.8, 1.0]},
        {"base": {"rpy_deg": [0, 0, 0]}, "duration": 300},
        sensors="fine",
        navigation="filtered",
        duration=0.3,
    )
    log = simulate(flight)
    assert np.abs(errors(log)[:150]).max() < 1.5e-4
    assert np.abs(errors(log)).max() < 2e-4


def test_what_points_needs_an_orbit() -> None:
    with pytest.raises(InputError, match=r"^start: base\.point: nadir needs an orbit"):
        flight_of("nadir", {"hold": 1})
