"""Flights do not depend on how the base stands in the inertial frame when they begin."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_model.robot.dynamics import inverse_dynamics
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]

SENSORS: dict[str, dict[str, Any]] = {
    "ideal": {},
    "fine": {"sensors": "fine", "navigation": "filtered"},
}
SWITCHING = ("tde_smc", "tde_stc", "tde_tsmc")
"""Laws with terms that jump or have an infinite slope at s = 0: behind ideal sensors, where nothing
but rounding moves them there, two flights differ as much as their limit cycle is wide."""
TURNED = np.array([0.5, -0.3, 0.7, 0.4])
"""Any start; near the identity a rotation is known far better than to rounding."""


def flown(law: str, sensors: str, start: Array, **options: Any) -> FlightLog:
    """Fly with the base held where it starts, (4,)."""
    quaternion = (start / np.linalg.norm(start)).tolist()
    return simulate(
        Flight(
            resolve(
                FlightPlan(
                    controller=law,
                    duration=0.5,
                    parameters={
                        "mission": {"base_quaternion": quaternion},
                        "plant": {"initial_quaternion": quaternion},
                    },
                    **SENSORS[sensors],
                    **options,
                )
            )
        )
    )


@cache
def unturned(law: str, sensors: str) -> FlightLog:
    """Fly from the identity."""
    return flown(law, sensors, np.array([1.0, 0.0, 0.0, 0.0]))


@cache
def by_rounding(law: str, sensors: str) -> float:
    """Return the largest change of the torque when a start is rounded otherwise, N m."""
    log, other = (flown(law, sensors, start) for start in (TURNED, np.nextafter(TURNED, 2.0)))
    return float(np.abs(other.applied_torque - log.applied_torque).max())


def rotation_error(log: FlightLog) -> Array:
    """Return the rotation vector (N, 3) from the desired attitude, rad, by SciPy."""
    actual, desired = log.quaternion, log.reference_base[:, :4]
    turn = Rotation.from_quat(desired[:, [1, 2, 3, 0]]).inv()
    error: Array = (turn * Rotation.from_quat(actual[:, [1, 2, 3, 0]])).as_rotvec()
    return error


starts = st.tuples(*[st.floats(-1.0, 1.0)] * 4).map(np.array).filter(lambda q: q @ q > 0.01)


@pytest.mark.parametrize("sensors", SENSORS)
@pytest.mark.parametrize("law", laws())
@settings(max_examples=2, deadline=None, suppress_health_check=list(HealthCheck))
@given(start=starts)
def test_torques_and_errors_are_those_of_any_other_start(
    law: str, sensors: str, start: Array
) -> None:
    log, other = unturned(law, sensors), flown(law, sensors, start)
    error = rotation_error(log)
    difference = np.abs(rotation_error(other) - error)
    torque = np.abs(other.applied_torque - log.applied_torque).max()
    if law in SWITCHING and sensors == "ideal":
        assert difference.max() < 2.0 * np.abs(error).max()
        return
    assert difference.max() < 1e-12
    # a quaternion is rounded to 1e-16, and gains are as large as 1e8 N m
    largest = np.abs(log.applied_torque).max()
    assert torque < 1e-9 * max(1.0, largest) + 30.0 * by_rounding(law, sensors)


@pytest.mark.parametrize("law", ["tde_stc", "pd", "ctc"])
@pytest.mark.parametrize("yaw", [175.0, 179.0, 180.0])
def test_half_a_turn_of_yaw_is_an_attitude_as_any_other(law: str, yaw: float) -> None:
    x, y, z, w = Rotation.from_euler("z", yaw, degrees=True).as_quat()
    log = flown(law, "ideal", np.array([w, x, y, z]))
    most = np.abs(rotation_error(log)).max()
    assert most == pytest.approx(np.abs(rotation_error(unturned(law, "ideal"))).max(), rel=0.05)
    assert most < np.radians(1e-4)


@pytest.mark.parametrize("law", laws())
def test_a_slew_leads_through_half_a_turn_to_almost_a_whole_one(law: str) -> None:
    """About a skew axis: the torque is that of the motion, the error as that of any other."""
    turn = {"turn_deg": 350.0, "axis": [1.0, 2.0, -1.5]}
    mission = {
        "start": {"joints_deg": [0, 90, 200, 20, 30, 10]},
        "segments": [{"base": turn, "duration": 20.0}],
    }
    flight = Flight(resolve(FlightPlan(controller=law, mission=mission, friction=False)))
    log = simulate(flight)
    planned = inverse_dynamics(flight.robot, log.references(0, log.ticks))
    largest = np.abs(planned[:, :3]).max()
    assert np.abs(log.applied_torque[:, :3]).max() < 1.1 * largest
    error = np.degrees(np.abs(rotation_error(log)).max())
    assert error < (0.1 if law == "tde_stc" else 5e-3)  # its K_1 and K_2 are small for 88 N m
    if law == "ctc":  # its model is exact: a term left out would show
        assert error < 1e-6
