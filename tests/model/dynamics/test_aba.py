"""qdd = H^-1 (F - c) against its own equation, Pinocchio and MuJoCo."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray
from oracles import mujoco_forward_dynamics, pinocchio_forward_dynamics
from random_robots import JOINTS, Case, State, cases, random_robot, random_state

from space_robot_model.dynamics.aba import solve_spatial
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import bias_force, forward_dynamics, mass_matrix

Array = NDArray[np.float64]

FEW = settings(max_examples=40)


def acceleration_of(robot: Robot, s: State, force: Array) -> Array:
    return forward_dynamics(robot, s.quaternion, s.theta, s.w0, s.rate, force)


def assert_close(actual: Array, expected: Array, tolerance: float) -> None:
    """Every element agrees to ``tolerance`` of the largest."""
    np.testing.assert_allclose(
        actual, expected, rtol=0.0, atol=tolerance * max(np.abs(expected).max(), 1.0)
    )


@FEW
@given(cases())
def test_acceleration_solves_the_equation_of_motion(case: Case) -> None:
    """H qdd + c = F."""
    robot, s, rng = case
    force = 50.0 * rng.normal(size=robot.n + 6)
    inertia = mass_matrix(robot, s.quaternion, s.theta)
    bias = bias_force(robot, s.quaternion, s.theta, s.w0, s.rate)
    acceleration = acceleration_of(robot, s, force)
    scale = (np.abs(inertia) @ np.abs(acceleration) + np.abs(bias) + np.abs(force)).max()
    residual = inertia @ acceleration + bias - force
    assert np.abs(residual).max() < 1e-11 * scale


@FEW
@given(cases())
def test_acceleration_agrees_with_pinocchio(case: Case) -> None:
    force = 50.0 * case.rng.normal(size=case.robot.n + 6)
    expected = pinocchio_forward_dynamics(case.robot, case.state, force)
    assert_close(acceleration_of(case.robot, case.state, force), expected, 1e-10)


@pytest.mark.parametrize("name", ["paper_robot", "seven_joint_robot"])
def test_acceleration_agrees_with_mujoco(name: str, request: pytest.FixtureRequest) -> None:
    """Another engine, another formulation; it is told the base's drift as well."""
    robot, rng = request.getfixturevalue(name), np.random.default_rng(2)
    for _ in range(10):
        state = random_state(rng, robot.n)
        force = 50.0 * rng.normal(size=robot.n + 6)
        expected = mujoco_forward_dynamics(robot, state, force)
        assert_close(acceleration_of(robot, state, force), expected, 1e-9)


@pytest.mark.parametrize("n", JOINTS)
def test_acceleration_of_random_robots_agrees_with_mujoco(n: int) -> None:
    rng = np.random.default_rng(n)
    robot, state = random_robot(rng, n), random_state(rng, n)
    force = 50.0 * rng.normal(size=n + 6)
    expected = mujoco_forward_dynamics(robot, state, force)
    assert_close(acceleration_of(robot, state, force), expected, 1e-8)


@FEW
@given(cases())
def test_only_a_force_on_the_base_moves_the_centre_of_mass(case: Case) -> None:
    """First rows of (7): H1 qdd + c1 = f0, whatever the torques are."""
    robot, s, rng = case
    inertia = mass_matrix(robot, s.quaternion, s.theta)
    bias = bias_force(robot, s.quaternion, s.theta, s.w0, s.rate)
    force = np.concatenate([np.zeros(3), 50.0 * rng.normal(size=robot.n + 3)])
    acceleration = acceleration_of(robot, s, force)
    scale = (np.abs(inertia[:3]) @ np.abs(acceleration)).max()
    np.testing.assert_allclose(
        inertia[:3] @ acceleration + bias[:3], np.zeros(3), atol=1e-12 * scale
    )


@given(cases(joints=[1, 3]))
@settings(max_examples=20)
def test_solve_spatial_agrees_with_numpy(case: Case) -> None:
    root = case.rng.normal(size=(6, 6))
    matrix = root @ root.T + 0.1 * np.eye(6)
    moment, force = case.rng.normal(size=(2, 3))
    j, g, m = matrix[:3, :3], matrix[:3, 3:], matrix[3:, 3:]
    upper = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
    solution = solve_spatial(
        tuple(j[upper]), tuple(g.ravel()), tuple(m[upper]), tuple(moment), tuple(force)
    )
    expected = np.linalg.solve(matrix, np.concatenate([moment, force]))
    np.testing.assert_allclose(np.concatenate(solution), expected, rtol=1e-8, atol=1e-10)
