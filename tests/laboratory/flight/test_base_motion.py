"""Bases at any attitude, that point, turn, and begin with a rate; and those that float freely."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from flights import planned, simulated
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from oracles.momenta import momentum
from scipy.spatial.transform import Rotation

from space_robot.analysis import analyze
from space_robot.analysis.errors import attitude_drift, tracking_error
from space_robot.flight.plan import Flight
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot.dynamics import inverse_dynamics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import SingularAttitudeError

JOINTS = [0, 90, 200, 20, 30, 10]
SENSORS: dict[str, dict[str, Any]] = {
    "ideal": {},
    "fine": {"sensors": "fine", "navigation": "filtered"},
}
SWITCHING = ("tde_smc", "tde_stc", "tde_tsmc")
"""Laws with terms that jump or have an infinite slope at s = 0: behind ideal sensors, where nothing
but rounding moves them there, two flights differ as much as their limit cycle is wide."""
UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])
TURNED = np.array([0.5, -0.3, 0.7, 0.4])
"""Any start; near the identity a rotation is known far better than to rounding."""


def flown(law: str, sensors: str, start: Array) -> FlightLog:
    """Fly with the base held where it starts, (4,)."""
    quaternion = (start / np.linalg.norm(start)).tolist()
    return simulated(
        controller=law,
        duration=0.2,
        parameters={
            "mission": {"base_quaternion": quaternion},
            "plant": {"initial_quaternion": quaternion},
        },
        **SENSORS[sensors],
    )


def rotation_error(log: FlightLog) -> Array:
    """Return the rotation vector (N, 3) from the desired attitude, rad, by SciPy."""
    actual, desired = log.quaternion, log.reference_base[:, :4]
    turn = Rotation.from_quat(desired[:, [1, 2, 3, 0]]).inv()
    error: Array = (turn * Rotation.from_quat(actual[:, [1, 2, 3, 0]])).as_rotvec()
    return error


starts = st.tuples(*[st.floats(-1.0, 1.0)] * 4).map(np.array).filter(lambda q: q @ q > 0.01)


@pytest.mark.parametrize(
    ("law", "sensors"),
    [*((law, "ideal") for law in laws()), *((law, "fine") for law in ("tde_stc", "pd", "ctc"))],
)
@settings(max_examples=2, deadline=None, suppress_health_check=list(HealthCheck))
@example(start=np.array([0.0, 0.0, 0.0, 1.0]))
@given(start=starts)
def test_torques_and_errors_are_those_of_any_other_start(
    law: str, sensors: str, start: Array
) -> None:
    attitudes = (UNTURNED, start, TURNED, np.nextafter(TURNED, 2.0))
    log, other, turned, rounded = (flown(law, sensors, one) for one in attitudes)
    error = rotation_error(log)
    difference = np.abs(rotation_error(other) - error)
    torque = np.abs(other.applied_torque - log.applied_torque).max()
    if law in SWITCHING and sensors == "ideal":
        assert difference.max() < 2.0 * np.abs(error).max()
        return
    assert difference.max() < 1e-12
    # a quaternion is rounded to 1e-16, and gains are as large as 1e8 N m
    largest = np.abs(log.applied_torque).max()
    by_rounding = np.abs(rounded.applied_torque - turned.applied_torque).max()
    assert torque < 1e-9 * max(1.0, largest) + 300.0 * by_rounding


@pytest.mark.parametrize("law", ["tde_stc", "ctc"])
def test_a_slew_leads_through_half_a_turn_to_almost_a_whole_one(law: str) -> None:
    """About a skew axis: the torque is that of the motion, the error as that of any other."""
    turn = {"turn_deg": 350.0, "axis": [1.0, 2.0, -1.5]}
    mission = {"start": {"joints_deg": JOINTS}, "segments": [{"base": turn, "duration": 20.0}]}
    flight = planned(controller=law, mission=mission, friction=False)
    log = simulate(flight)
    wanted = inverse_dynamics(flight.robot, log.references(0, log.ticks))
    largest = np.abs(wanted[:, :3]).max()
    assert np.abs(log.applied_torque[:, :3]).max() < 1.1 * largest
    error = np.degrees(np.abs(rotation_error(log)).max())
    assert error < (0.1 if law == "tde_stc" else 5e-3)  # its K_1 and K_2 are small for 88 N m
    if law == "ctc":  # its model is exact: a term left out would show
        assert error < 1e-6


def flight_of(start: Any, *segments: dict[str, Any], law: str = "ctc", **options: Any) -> Flight:
    mission = {"start": {"joints_deg": JOINTS, "base": start}, "segments": list(segments)}
    return planned(mission=mission, controller=law, **options)


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
    assert np.abs(rotation_error(log)).max() < 1e-6
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
    assert np.abs(rotation_error(log)).max() < 1e-6


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
    assert np.abs(rotation_error(log)[:150]).max() < 1.5e-4
    assert np.abs(rotation_error(log)).max() < 2e-4


# Nothing turns the base


@pytest.mark.parametrize(
    ("law", "most"), [("ctc", 1e-6), ("ctc_smc", 1e-4), ("tde_stc", 1e-2), ("indi", 1e-6)]
)
def test_a_free_base_is_turned_by_its_arm_without_momentum(law: str, most: float) -> None:
    """Its momenta, by Pinocchio, stay those of the start; the joints follow as ever."""
    goal = [60, 40, 150, 60, 60, -40]
    flight = flight_of(
        {"rpy_deg": [0, 0, 0]},
        {"joints_deg": goal, "duration": 2.0},
        law=law,
        gains="tuned",
        actuators="none",
        friction=False,
    )
    log = simulate(flight)
    for kept in momentum(flight.robot, log.state(log.ticks - 1)):
        assert np.abs(kept).max() < 1e-9
    assert np.abs(tracking_error(log)[:, 3:]).max() < most
    turned = Rotation.from_quat(log.quaternion[-1], scalar_first=True).magnitude()
    assert turned > 0.1
    assert analyze(log)["metrics"]["attitude_drift.end"] == pytest.approx(turned)


@pytest.mark.parametrize("law", ["ctc", "tde_stc"])
def test_half_a_turn_is_an_attitude_like_any_other(law: str) -> None:
    """There the laws refuse to hold a base; joints of a free one fly as ever."""
    turned = {"plant": {"initial_quaternion": [0.0, 0.0, 0.6, 0.8]}}
    options: dict[str, Any] = {"controller": law, "actuators": "none", "duration": 0.3}
    upright, log = simulated(**options), simulated(**options, parameters=turned)
    errors = [tracking_error(flown)[:, 3:] for flown in (upright, log)]
    np.testing.assert_allclose(errors[1], errors[0], rtol=0, atol=1e-11)
    np.testing.assert_allclose(attitude_drift(log), attitude_drift(upright), rtol=0, atol=1e-9)
    with pytest.raises(SingularAttitudeError):
        simulated(controller=law, duration=0.01, parameters=turned)
