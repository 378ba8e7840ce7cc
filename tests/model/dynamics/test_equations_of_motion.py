"""H and c of (7) against Pinocchio, and against the laws of mechanics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray
from oracles import (
    pinocchio_bias_force,
    pinocchio_mass_matrix,
    quaternion_of,
    rotation_of,
    to_base_axes,
    turned,
)
from random_robots import Case, State, cases, random_quaternion, random_state

from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import bias_force, forward_dynamics, mass_matrix

Array = NDArray[np.float64]

FEW = settings(max_examples=40)
RELATIVE = 1e-10


def assert_relative(actual: Array, expected: Array, tolerance: float = RELATIVE) -> None:
    """Every element agrees to ``tolerance`` of the largest."""
    np.testing.assert_allclose(
        actual, expected, rtol=0.0, atol=tolerance * max(np.abs(expected).max(), 1e-3)
    )


def inertia_of(robot: Robot, state: State) -> Array:
    return mass_matrix(robot, state.quaternion, state.theta)


def bias_of(robot: Robot, state: State) -> Array:
    return bias_force(robot, state.quaternion, state.theta, state.w0, state.rate)


def inertia_rate(robot: Robot, state: State, step: float = 1e-5) -> Array:
    """Hdot along the state's motion: fourth-order central difference."""

    def at(time: float) -> Array:
        return mass_matrix(
            robot, turned(state.quaternion, time * state.w0), state.theta + time * state.rate
        )

    return (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step)


@pytest.mark.parametrize("name", ["paper_robot", "seven_joint_robot"])
def test_shipped_robots_agree_with_pinocchio(name: str, request: pytest.FixtureRequest) -> None:
    """H and c of both robots, in 20 random states each."""
    robot, rng = request.getfixturevalue(name), np.random.default_rng(1)
    for _ in range(20):
        state = random_state(rng, robot.n)
        assert_relative(inertia_of(robot, state), pinocchio_mass_matrix(robot, state))
        assert_relative(bias_of(robot, state), pinocchio_bias_force(robot, state))


@FEW
@given(cases())
def test_mass_matrix_agrees_with_pinocchio_for_any_robot_wherever_the_base_stands(
    case: Case,
) -> None:
    """Pinocchio is given a base position; H has none to be given."""
    position = 100.0 * case.rng.normal(size=3)
    expected = pinocchio_mass_matrix(case.robot, case.state, position)
    assert_relative(inertia_of(case.robot, case.state), expected)


@FEW
@given(cases())
def test_bias_force_agrees_with_pinocchio_for_any_robot_however_fast_the_base_drifts(
    case: Case,
) -> None:
    """Pinocchio is given position and velocity of the base; c does not depend on either."""
    position = 100.0 * case.rng.normal(size=3)
    expected = pinocchio_bias_force(case.robot, case.state, position)
    assert_relative(bias_of(case.robot, case.state), expected)


@FEW
@given(cases())
def test_mass_matrix_is_symmetric_positive_definite(case: Case) -> None:
    inertia = inertia_of(case.robot, case.state)
    np.testing.assert_array_equal(inertia, inertia.T)
    assert np.linalg.eigvalsh(inertia)[0] > 0.0


@FEW
@given(cases())
def test_mass_matrix_begins_with_the_total_mass(case: Case) -> None:
    """H11 = M E, which the elimination of the translation builds on."""
    total = case.robot.mass.sum()
    assert_relative(inertia_of(case.robot, case.state)[:3, :3], total * np.eye(3), 1e-14)


@FEW
@given(cases())
def test_bias_force_vanishes_at_rest(case: Case) -> None:
    n = case.robot.n
    at_rest = bias_force(
        case.robot, case.state.quaternion, case.state.theta, np.zeros(3), np.zeros(n)
    )
    np.testing.assert_array_equal(at_rest, np.zeros(n + 6))


@FEW
@given(cases())
def test_bias_force_is_quadratic_in_the_velocities(case: Case) -> None:
    s = case.state
    twice = s._replace(w0=-3.0 * s.w0, rate=-3.0 * s.rate)
    assert_relative(bias_of(case.robot, twice), 9.0 * bias_of(case.robot, s), 1e-13)


@FEW
@given(cases())
def test_bias_force_does_half_the_work_of_the_changing_inertia(case: Case) -> None:
    """``qdot.c = qdot.Hdot qdot / 2``: (Hdot - 2C) takes and gives no energy."""
    velocity = case.state.velocity
    expected = 0.5 * velocity @ inertia_rate(case.robot, case.state) @ velocity
    scale = np.abs(velocity) @ np.abs(bias_of(case.robot, case.state))
    assert velocity @ bias_of(case.robot, case.state) == pytest.approx(expected, abs=1e-7 * scale)


@FEW
@given(cases())
def test_bias_force_on_the_base_is_the_momentum_that_the_changing_inertia_moves(case: Case) -> None:
    """``c1 = Hdot1 qdot``; about the moving base CoM ``c2 = Hdot2 qdot + v0 x p``."""
    velocity = case.state.velocity
    rate = inertia_rate(case.robot, case.state)[:6] @ velocity
    momentum = inertia_of(case.robot, case.state)[:3] @ velocity
    rate[3:] += np.cross(case.state.v0, momentum)
    scale = max(np.abs(rate).max(), np.abs(momentum).max())
    np.testing.assert_allclose(bias_of(case.robot, case.state)[:6], rate, atol=1e-7 * scale)


@FEW
@given(cases())
def test_power_of_the_force_is_the_rate_of_the_kinetic_energy(case: Case) -> None:
    """dT/dt = qdot.F, T's rate by a central difference along the motion that F causes."""
    robot, s, rng = case
    force = 50.0 * rng.normal(size=robot.n + 6)
    acceleration = forward_dynamics(robot, s.quaternion, s.theta, s.w0, s.rate, force)

    def kinetic_energy(time: float) -> float:
        velocity = s.velocity + time * acceleration
        inertia = mass_matrix(robot, turned(s.quaternion, time * s.w0), s.theta + time * s.rate)
        return float(0.5 * velocity @ inertia @ velocity)

    step = 1e-6
    rate = (kinetic_energy(step) - kinetic_energy(-step)) / (2.0 * step)
    scale = kinetic_energy(0.0) + np.abs(s.velocity) @ np.abs(force)
    assert rate == pytest.approx(s.velocity @ force, abs=1e-6 * scale)


@FEW
@given(cases())
def test_turning_the_whole_robot_turns_the_base_blocks_only(case: Case) -> None:
    """Attitude p*q and R(p) w0: H and c turn their base parts by R(p), joint parts stay."""
    robot, s, rng = case
    turn = rotation_of(random_quaternion(rng))
    quaternion = quaternion_of(turn * rotation_of(s.quaternion))
    moved = s._replace(quaternion=quaternion, w0=turn.apply(s.w0))
    spread = to_base_axes(quaternion_of(turn), robot.n + 6).T
    assert_relative(inertia_of(robot, moved), spread @ inertia_of(robot, s) @ spread.T, 1e-13)
    assert_relative(bias_of(robot, moved), spread @ bias_of(robot, s), 1e-12)


@FEW
@given(cases())
def test_both_signs_of_the_quaternion_are_one_attitude(case: Case) -> None:
    s = case.state
    other = s._replace(quaternion=-s.quaternion)
    np.testing.assert_array_equal(inertia_of(case.robot, other), inertia_of(case.robot, s))
    np.testing.assert_array_equal(bias_of(case.robot, other), bias_of(case.robot, s))


def test_wrong_shapes_and_quaternions_are_refused_by_name(paper_robot: Robot) -> None:
    theta, still = np.zeros(6), np.zeros(3)
    unit = [1.0, 0.0, 0.0, 0.0]
    with pytest.raises(ValueError, match=r"joint_positions must have shape \(6,\), got \(5,\)"):
        mass_matrix(paper_robot, unit, theta[:5])
    with pytest.raises(ValueError, match=r"quaternion_wxyz must have norm 1, got 2"):
        mass_matrix(paper_robot, [2.0, 0.0, 0.0, 0.0], theta)
    with pytest.raises(ValueError, match=r"w0_inertial must have shape \(3,\)"):
        bias_force(paper_robot, unit, theta, [0.0], theta)
    with pytest.raises(ValueError, match=r"force must have shape \(12,\)"):
        forward_dynamics(paper_robot, unit, theta, still, theta, np.zeros(9))
