"""What a mission asks for against power: a force on eps does the work of the torque behind it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from space_robot.tuning.demand import demand
from space_robot_control.guidance.mission import MissionSettings
from space_robot_model.robot.find import find_robot
from space_robot_sim.environment.environment import EnvironmentSettings

PLACE = [10.0, 50.0, 90.0, 20.0, 30.0, 40.0]


def eps(attitude: Rotation) -> np.ndarray:
    x, y, z, w = attitude.as_quat()
    return np.array([x, y, z]) * (1.0 if w >= 0.0 else -1.0)


@given(st.lists(st.floats(-0.9, 0.9), min_size=3, max_size=3))
def test_disturbances_about_inertial_axes_are_turned_to_the_bases(vector: list[float]) -> None:
    """At rest nothing else is asked for; the disturbance is the same about each inertial axis."""
    attitude = Rotation.from_rotvec(vector)
    x, y, z, w = attitude.as_quat()
    mission = MissionSettings(
        waypoint_times=[0.0, 4.0], waypoints_deg=PLACE * 2, base_quaternion=[w, x, y, z]
    )
    case = EnvironmentSettings.model_validate(
        {"disturbance": {"scale": 1.0}, "friction": {"coulomb": 0.0, "viscous": 0.0}}
    )
    found = demand(find_robot("paper"), mission, [case])
    time = 0.05 * np.arange(81)
    wave = np.sin(2 * np.pi * 0.5 * time) + np.sin(2 * np.pi * 0.75 * time)
    torque = attitude.inv().apply(np.full(3, 0.010))
    step = 1e-6  # about the desired attitude
    rates = [
        (eps(Rotation.from_rotvec(step * axis)) - eps(Rotation.from_rotvec(-step * axis)))
        / (2.0 * step)
        for axis in np.eye(3)
    ]
    force = np.linalg.solve(np.array(rates), torque)  # F . epsdot = torque . omega, of any omega
    np.testing.assert_allclose(found.peak[:3], np.abs(force) * np.abs(wave).max(), rtol=1e-5)
    np.testing.assert_array_equal(found.nominal, 0.0)
    assert found.peak[3] == pytest.approx(
        0.005 * np.abs(np.sin(2 * np.pi * 0.25 * time) + np.sin(2 * np.pi * 0.5 * time)).max()
    )
