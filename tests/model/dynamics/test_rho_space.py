"""H_S and c_S of (25), (28) against their formulas in dense NumPy, far from the identity."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from numpy.typing import NDArray
from oracles import attitude_jacobian_inertial, rotation_of, skew, turned
from random_robots import Case, State, branched_cases, cases, random_state

from space_robot_model.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import bias_force, forward_dynamics, mass_matrix

Array = NDArray[np.float64]

FEW = settings(max_examples=40)
CLOSEST_ETA = 0.05
"""|eta| of random attitudes; from 174 degrees on, J0^-1 magnifies rounding too much to compare."""


def rho_space(robot: Robot, s: State) -> tuple[Array, Array]:
    """H_S and c_S by the code under test."""
    out = RhoSpaceModel.allocate(robot.n)
    omega_base = rotation_of(s.quaternion).inv().apply(s.w0)
    rho_space_into(robot.model, s.quaternion, s.theta, omega_base, s.rate, out)
    return out.inertia, out.bias


def jacobian_rate(s: State) -> Array:
    """J0dot on inertial axes from epsdot and etadot."""
    epsilon_rate = attitude_jacobian_inertial(s.quaternion) @ s.w0
    eta_rate = -0.5 * s.quaternion[1:] @ s.w0  # eps is the same on base and inertial axes
    return 0.5 * (eta_rate * np.eye(3) - skew(epsilon_rate))


def block_diagonal(corner: Array, size: int, rest: float) -> Array:
    matrix = rest * np.eye(size)
    matrix[:3, :3] = corner
    return matrix


def reduced(robot: Robot, s: State) -> tuple[Array, Array]:
    """H_r and c_r: the base translation eliminated."""
    h = mass_matrix(robot, s.quaternion, s.theta)
    c = bias_force(robot, s.quaternion, s.theta, s.w0, s.rate)
    share = h[3:, :3] @ np.linalg.inv(h[:3, :3])
    return h[3:, 3:] - share @ h[:3, 3:], c[3:] - share @ c[:3]


def assert_relative(actual: Array, expected: Array, tolerance: float = 1e-10) -> None:
    """Every element agrees to ``tolerance`` of the largest."""
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance * np.abs(expected).max())


@FEW
@given(cases() | branched_cases())
def test_model_agrees_with_the_formulas_in_the_spec(case: Case) -> None:
    """``H_S = J^-T H_r J^-1``, ``c_S = J^-T (c_r - H_r J^-1 Jdot J^-1 rhodot)``."""
    robot, s, _ = case
    assume(abs(s.quaternion[0]) > CLOSEST_ETA)
    size = robot.n + 3
    h_r, c_r = reduced(robot, s)
    jacobian = block_diagonal(attitude_jacobian_inertial(s.quaternion), size, 1.0)
    rate = block_diagonal(jacobian_rate(s), size, 0.0)
    inverse = np.linalg.inv(jacobian)
    rho_rate = jacobian @ np.concatenate([s.w0, s.rate])
    inertia, bias = rho_space(robot, s)
    assert_relative(inertia, inverse.T @ h_r @ inverse)
    assert_relative(bias, inverse.T @ (c_r - h_r @ inverse @ rate @ inverse @ rho_rate))


@FEW
@given(cases() | branched_cases())
def test_elimination_before_and_after_the_change_of_coordinates_agree(case: Case) -> None:
    """(25) on all n+6 coordinates, then the Schur complement, is the same model."""
    robot, s, _ = case
    assume(abs(s.quaternion[0]) > CLOSEST_ETA)
    size = robot.n + 6
    jacobian, rate = np.eye(size), np.zeros((size, size))
    jacobian[3:6, 3:6] = attitude_jacobian_inertial(s.quaternion)
    rate[3:6, 3:6] = jacobian_rate(s)
    inverse = np.linalg.inv(jacobian)
    h = mass_matrix(robot, s.quaternion, s.theta)
    c = bias_force(robot, s.quaternion, s.theta, s.w0, s.rate)
    h_s = inverse.T @ h @ inverse
    c_s = inverse.T @ (c - h @ inverse @ rate @ s.velocity)
    share = h_s[3:, :3] @ np.linalg.inv(h_s[:3, :3])
    inertia, bias = rho_space(robot, s)
    assert_relative(inertia, h_s[3:, 3:] - share @ h_s[:3, 3:])
    assert_relative(bias, c_s[3:] - share @ c_s[:3])


@FEW
@given(cases() | branched_cases())
def test_model_explains_the_motion_of_the_free_robot(case: Case) -> None:
    """H_S rhodd + c_S = F_S = J^-T F, rhodd from forward_dynamics with f0 = 0."""
    robot, s, rng = case
    assume(abs(s.quaternion[0]) > CLOSEST_ETA)
    torque = 50.0 * rng.normal(size=robot.n + 3)
    force = np.concatenate([np.zeros(3), torque])
    acceleration = forward_dynamics(robot, s.quaternion, s.theta, s.w0, s.rate, force)[3:]
    j0 = attitude_jacobian_inertial(s.quaternion)
    jacobian = block_diagonal(j0, robot.n + 3, 1.0)
    rho_acceleration = jacobian @ acceleration
    rho_acceleration[:3] += jacobian_rate(s) @ s.w0
    inertia, bias = rho_space(robot, s)
    expected = np.linalg.solve(jacobian.T, torque)
    scale = (np.abs(inertia) @ np.abs(rho_acceleration) + np.abs(bias) + np.abs(expected)).max()
    residual = inertia @ rho_acceleration + bias - expected
    assert np.abs(residual).max() < 1e-10 * scale


def test_convective_term_agrees_with_a_finite_difference_of_the_attitude(
    paper_robot: Robot,
) -> None:
    """The spec's J0dot w0 (used above) is the second derivative of eps at constant w0."""
    rng, step = np.random.default_rng(3), 1e-3
    for _ in range(20):
        s = random_state(rng, paper_robot.n)
        before, now, after = (turned(s.quaternion, k * step * s.w0)[1:] for k in (-1, 0, 1))
        second = (before - 2.0 * now + after) / step**2
        np.testing.assert_allclose(jacobian_rate(s) @ s.w0, second, atol=1e-5)


@FEW
@given(cases() | branched_cases())
def test_inertia_is_symmetric_positive_definite(case: Case) -> None:
    assume(abs(case.state.quaternion[0]) > CLOSEST_ETA)
    inertia, _ = rho_space(case.robot, case.state)
    assert_relative(inertia, inertia.T, 1e-13)
    assert np.linalg.eigvalsh(0.5 * (inertia + inertia.T))[0] > 0.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_the_identity_the_coordinates_are_half_angles(paper_robot: Robot, sign: float) -> None:
    """J0 = +-E/2 there, so the base's own inertia counts four times."""
    rng = np.random.default_rng(4)
    s = random_state(rng, 6)._replace(quaternion=np.array([sign, 0.0, 0.0, 0.0]))
    h_r, c_r = reduced(paper_robot, s)
    stretch = np.diag([2.0 * sign] * 3 + [1.0] * 6)
    inertia, bias = rho_space(paper_robot, s)
    assert_relative(inertia, stretch @ h_r @ stretch, 1e-13)
    assert_relative(bias, stretch @ c_r, 1e-13)
