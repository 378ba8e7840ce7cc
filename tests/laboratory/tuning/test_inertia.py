"""H_S in many configurations at once, against Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import pinocchio_mass_matrix, rho_space_inertia
from robots import PASSIVE_ROBOT
from strategies import State, random_quaternion, random_robot

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.tuning.inertia import (
    free_inertia,
    inertia_along,
    inertia_in_rho,
    loose_inertia,
    semi_floating_inertia,
)
from space_robot.tuning.spectrum import eigenvalues
from space_robot_model.robot.dynamics import mass_matrix

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 6, 9]))
@settings(max_examples=25, deadline=None)
def test_it_is_pinocchios(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    robot, theta = random_robot(rng, n), rng.uniform(-np.pi, np.pi, (3, n))
    found = inertia_in_rho(semi_floating_inertia(robot, theta))
    for inertia, positions in zip(found, theta, strict=True):
        expected = rho_space_inertia(robot, UPRIGHT, positions)
        np.testing.assert_allclose(inertia, expected, rtol=1e-9, atol=1e-9 * np.max(expected))


def test_both_ends_of_a_mission_are_looked_at() -> None:
    flight = Flight(resolve(FlightPlan(robot="seven_joint")))
    found = inertia_along(flight.robot, flight.mission_settings, step=7.0)
    assert found.shape == (6, 10, 10)  # 0, 7, ... 28 and beyond the end at 30 s
    waypoints = np.radians(flight.mission_settings.waypoints_deg).reshape(3, 7)
    for row, theta in ((0, waypoints[0]), (-1, waypoints[-1])):
        expected = rho_space_inertia(flight.robot, UPRIGHT, theta)
        np.testing.assert_allclose(found[row], expected, rtol=1e-10, atol=1e-8)


def test_a_mission_that_does_not_fit_is_refused() -> None:
    flight = Flight(resolve(FlightPlan()))
    with pytest.raises(ValueError, match="need 21"):
        inertia_along(
            Flight(resolve(FlightPlan(robot="seven_joint"))).robot, flight.mission_settings
        )


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 6, 9]))
@settings(max_examples=25, deadline=None)
def test_without_base_it_is_pinocchios_with_six_coordinates_eliminated(seed: int, n: int) -> None:
    """At any attitude, from H_r and from H_S."""
    rng = np.random.default_rng(seed)
    robot, quaternion = random_robot(rng, n), random_quaternion(rng)
    theta = rng.uniform(-np.pi, np.pi, (2, n))
    h_r = semi_floating_inertia(robot, theta)
    zero = np.zeros(3)
    for k, inertia in enumerate(free_inertia(h_r)):
        h = pinocchio_mass_matrix(robot, State(quaternion, theta[k], zero, zero, 0.0 * theta[k]))
        expected = h[6:, 6:] - h[6:, :6] @ np.linalg.solve(h[:6, :6], h[:6, 6:])
        np.testing.assert_allclose(inertia, expected, rtol=0, atol=1e-10 * np.abs(h).max())
    found = free_inertia(inertia_in_rho(h_r))
    np.testing.assert_allclose(found, free_inertia(h_r), rtol=0, atol=1e-8 * np.max(h_r))


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 6, 9]))
@settings(max_examples=25, deadline=None)
def test_a_free_base_takes_no_margin_away(seed: int, n: int) -> None:
    """Cauchy's interlacing: eigenvalues of H_f^-1 h_bar lie between those of H_S^-1 h_bar."""
    rng = np.random.default_rng(seed)
    robot, h_bar = random_robot(rng, n), rng.uniform(0.1, 100.0, n + 3)
    h_r = semi_floating_inertia(robot, rng.uniform(-np.pi, np.pi, (3, n)))
    whole = eigenvalues(inertia_in_rho(h_r), h_bar)
    joints = eigenvalues(free_inertia(h_r), h_bar[3:])
    slack = 1e-9 * whole[:, -1]
    assert (joints[:, 0] >= whole[:, 0] - slack).all()
    assert (joints[:, -1] <= whole[:, -1] + slack).all()


@pytest.mark.parametrize("controls_base", [True, False])
def test_along_a_mission_no_attitude_makes_a_difference(controls_base: bool) -> None:
    """The base is where it is desired, be that 180 degrees from the inertial frame."""
    flight = Flight(resolve(FlightPlan()))
    settings = flight.mission_settings
    found = inertia_along(flight.robot, settings, step=5.0, controls_base=controls_base)
    assert found.shape == ((7, 9, 9) if controls_base else (7, 6, 6))
    for quaternion in ([0.0, 1.0, 0.0, 0.0], [0.1, 0.7, 0.5, -0.5]):
        turned = settings.model_copy(update={"base_quaternion": quaternion})
        again = inertia_along(flight.robot, turned, step=5.0, controls_base=controls_base)
        np.testing.assert_array_equal(again, found)


def test_loose_joints_give_way_and_locked_ones_do_not() -> None:
    """The accelerations of attitude and motors under their forces alone, from the whole inertia."""
    flight = Flight(resolve(FlightPlan(robot=PASSIVE_ROBOT)))
    robot, rest = flight.robot, [spring.rest for spring in flight.robot.springs]
    theta = np.array([[0.3, 0.5, -0.8, 0.1, -0.4, 1.0], [-1.2, 1.1, 2.0, -0.7, 0.6, 0.2]])
    moved = range(3, 12)
    for positions, found in zip(theta, loose_inertia(robot, theta), strict=True):
        whole = mass_matrix(robot, [1.0, 0.0, 0.0, 0.0], [*positions, *rest])
        expected = np.linalg.inv(np.linalg.inv(whole)[np.ix_(moved, moved)])
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10)
        locked = semi_floating_inertia(robot.nominal, positions[np.newaxis])[0]
        assert np.linalg.eigvalsh(locked - found).min() > -1e-12
    both = inertia_along(robot, flight.mission_settings, step=2.0)
    assert both.shape == (10, 9, 9)
    start = robot.from_degrees(flight.mission_settings.waypoints_deg[:6])[np.newaxis]
    for row, inertia in (
        (0, semi_floating_inertia(robot.nominal, start)),
        (5, loose_inertia(robot, start)),
    ):
        np.testing.assert_allclose(both[row], inertia_in_rho(inertia)[0], rtol=1e-12)
