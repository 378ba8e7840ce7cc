"""H_S in many configurations at once, against Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import rho_space_inertia
from random_robots import random_quaternion, random_robot

from space_robot_control.flight.plan import Flight, FlightPlan
from space_robot_control.tuning.inertia import (
    inertia_along,
    inertia_in_rho,
    semi_floating_inertia,
)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 6, 9]))
@settings(max_examples=25, deadline=None)
def test_it_is_pinocchios(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    robot, quaternion = random_robot(rng, n), random_quaternion(rng)
    if abs(quaternion[0]) < 0.05:  # near 180 degrees it has no bound
        quaternion = np.array([1.0, 0.0, 0.0, 0.0])
    theta = rng.uniform(-np.pi, np.pi, (3, n))
    found = inertia_in_rho(quaternion, semi_floating_inertia(robot, theta))
    for inertia, positions in zip(found, theta, strict=True):
        expected = rho_space_inertia(robot, quaternion, positions)
        np.testing.assert_allclose(inertia, expected, rtol=1e-9, atol=1e-9 * np.max(expected))


def test_both_ends_of_a_mission_are_looked_at() -> None:
    flight = Flight(FlightPlan(robot="seven_joint"))
    found = inertia_along(flight.robot, flight.mission_settings, step=7.0)
    assert found.shape == (6, 10, 10)  # 0, 7, ... 28 and beyond the end at 30 s
    waypoints = np.radians(flight.mission_settings.waypoints_deg).reshape(3, 7)
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    for row, theta in ((0, waypoints[0]), (-1, waypoints[-1])):
        expected = rho_space_inertia(flight.robot, upright, theta)
        np.testing.assert_allclose(found[row], expected, rtol=1e-10, atol=1e-8)


def test_a_mission_that_does_not_fit_is_refused() -> None:
    flight = Flight(FlightPlan())
    with pytest.raises(ValueError, match="need 21"):
        inertia_along(Flight(FlightPlan(robot="seven_joint")).robot, flight.mission_settings)
