"""Equations of motion: of a free base, with rotors, and linear in second moments of mass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import (
    attitude_jacobian_base,
    attitude_jacobian_inertial,
    in_inertial,
    pinocchio_acceleration,
    pinocchio_bias_force,
    pinocchio_forward_dynamics,
    pinocchio_mass_matrix,
    references_of,
    rotation_of,
    skew,
)
from oracles.rotors import (
    RotorEquations,
    mount,
    pinocchio_with_wheels,
    random_motor_rotors,
    random_rotors,
    turns,
)
from oracles.second_moments import jacobians, second_moments
from robots import mounted
from strategies import (
    SEEDS,
    Case,
    State,
    branched_cases,
    cases,
    random_gears,
    random_robot,
    random_state,
    random_tree,
)

from space_robot_model.dynamics.aba import aba
from space_robot_model.dynamics.kinematics import forward_kinematics, spatial_velocities
from space_robot_model.dynamics.model import Data
from space_robot_model.dynamics.regressor import (
    Regressor,
    force_in_rho,
    force_on_vectors_into,
    motions_into,
    take_rho,
    vectors_into,
)
from space_robot_model.dynamics.rho_space import (
    RhoSpaceModel,
    eliminate_rotation,
    rho_space_into,
    semi_floating_into,
)
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import (
    bias_force,
    forward_dynamics,
    free_inverse_dynamics,
    inverse_dynamics,
    mass_matrix,
)
from space_robot_msgs_py.samples import MOST_WHEELS, ReferenceChunk

FEW = settings(max_examples=40)


@FEW
@given(cases() | branched_cases())
def test_it_is_what_moves_pinocchios_robot_so(case: Case) -> None:
    """And the base's CoM is free: no force holds it."""
    robot, rng = case.robot, case.rng
    states = [case.state, random_state(rng, robot.n)]
    accelerations = rng.normal(size=(2, robot.n + 3))
    torques = inverse_dynamics(robot, references_of(states, accelerations))
    for state, torque, wanted in zip(states, torques, accelerations, strict=True):
        moved = pinocchio_forward_dynamics(robot, state, in_inertial(state, torque))
        np.testing.assert_allclose(moved[3:], wanted, atol=1e-8 * (1.0 + np.abs(moved).max()))


def free_floating(robot: Robot, s: State) -> tuple[Array, Array]:
    """The model by the code under test, base axes included."""
    out = RhoSpaceModel.allocate(robot.n)
    omega_base = rotation_of(s.quaternion).inv().apply(s.w0)
    semi_floating_into(robot.model, s.quaternion, s.theta, omega_base, s.rate, out)
    eliminate_rotation(out)
    return out.inertia, out.bias


def half_turned(s: State) -> State:
    """The state with its base turned by 180 degrees, where J0 is singular."""
    axis = s.quaternion[1:] / np.linalg.norm(s.quaternion[1:])
    return s._replace(quaternion=np.concatenate([[0.0], axis]))


@FEW
@given(cases() | branched_cases())
def test_joints_are_the_schur_complement_of_pinocchios_h_and_c(case: Case) -> None:
    """At any attitude, half a turn included; the base's axes stand apart."""
    robot = case.robot
    for s in (case.state, half_turned(case.state)):
        h, c = pinocchio_mass_matrix(robot, s), pinocchio_bias_force(robot, s)
        share = h[6:, :6] @ np.linalg.inv(h[:6, :6])
        h_f, c_f = h[6:, 6:] - share @ h[:6, 6:], c[6:] - share @ c[:6]
        inertia, bias = free_floating(robot, s)
        np.testing.assert_allclose(inertia[3:, 3:], h_f, rtol=0, atol=1e-11 * np.abs(h).max())
        np.testing.assert_allclose(bias[3:], c_f, rtol=0, atol=1e-10 * np.abs(c).max())
        apart = np.hstack([np.eye(3), np.zeros((3, robot.n))])
        np.testing.assert_array_equal(inertia[:3], apart)
        np.testing.assert_array_equal(inertia[:, :3], apart.T)
        np.testing.assert_array_equal(bias[:3], 0.0)


@FEW
@given(cases() | branched_cases())
def test_inverse_dynamics_is_pinocchios_without_momentum(case: Case) -> None:
    """The base turns as momentum asks, and its axes get nothing."""
    robot, s, rng = case
    accelerations = rng.normal(size=robot.n)
    joints = np.stack([s.theta, s.rate, accelerations])[np.newaxis]
    base = np.concatenate([s.quaternion, rng.normal(size=6)])[np.newaxis]
    torque = free_inverse_dynamics(robot, ReferenceChunk(0, joints, base).references())[0]
    assert (torque[:3] == 0.0).all()
    h = pinocchio_mass_matrix(robot, s)
    turning = -np.linalg.solve(h[:6, :6], h[:6, 6:] @ s.rate)
    moving = s._replace(v0=turning[:3], w0=turning[3:])
    found = pinocchio_forward_dynamics(robot, moving, np.concatenate([np.zeros(3), torque]))[6:]
    size = 1.0 + np.abs(np.linalg.inv(free_floating(robot, s)[0])).max() * np.abs(torque).max()
    np.testing.assert_allclose(found, accelerations, rtol=0, atol=1e-11 * size)


@FEW
@given(cases() | branched_cases())
def test_inertia_is_symmetric_and_no_bias_is_at_rest(case: Case) -> None:
    """Q and -Q are one attitude; all else is Pinocchio's in test_tree."""
    robot, s, _ = case
    inertia, motion = mass_matrix(robot, s.quaternion, s.theta), (s.theta, s.w0, s.rate)
    np.testing.assert_array_equal(inertia, inertia.T)
    np.testing.assert_array_equal(mass_matrix(robot, -s.quaternion, s.theta), inertia)
    bias = bias_force(robot, s.quaternion, *motion)
    np.testing.assert_array_equal(bias_force(robot, -s.quaternion, *motion), bias)
    still = bias_force(robot, s.quaternion, s.theta, np.zeros(3), 0.0 * s.rate)
    np.testing.assert_array_equal(still, np.zeros(robot.n + 6))


@pytest.mark.parametrize(
    ("function", "changed", "said"),
    [
        (mass_matrix, {1: np.zeros(5)}, r"joint_positions must have shape \(6,\), got \(5,\)"),
        (mass_matrix, {0: [2.0, 0.0, 0.0, 0.0]}, "quaternion_wxyz must have norm 1, got 2"),
        (bias_force, {2: [0.0]}, r"w0_inertial must have shape \(3,\)"),
        (forward_dynamics, {4: np.zeros(9)}, r"force must have shape \(12,\)"),
    ],
)
def test_wrong_shapes_and_quaternions_are_refused_by_name(
    paper_robot: Robot, function: Callable[..., Array], changed: dict[int, Any], said: str
) -> None:
    right: list[Any] = [[1.0, 0.0, 0.0, 0.0], np.zeros(6), np.zeros(3), np.zeros(6), np.zeros(12)]
    count = {mass_matrix: 2, bias_force: 4, forward_dynamics: 5}[function]
    given = [changed.get(k, values) for k, values in enumerate(right[:count])]
    with pytest.raises(ValueError, match=said):
        function(paper_robot, *given)


TREE = (
    *("revolute", "passive revolute", "prismatic", "revolute", "fixed"),
    *("revolute", "passive prismatic", "prismatic", "revolute"),
)


def accelerate(
    model: Any, n: int, s: State, theta: Array, rates: Array, force: Array, locked: Array
) -> tuple[Array, Array]:
    """Accelerations, and the torques that hold what is locked, in the model's order."""
    data, out = Data.allocate(n), np.empty(force.size)
    forward_kinematics(model, s.quaternion, theta, data)
    spatial_velocities(model, s.w0, rates, data)
    data.locked[: locked.size] = locked
    aba(model, s.w0, rates, force, data, out)
    return out, data.holding[: locked.size].copy()


@given(st.sampled_from([1, 6]), st.integers(1, MOST_WHEELS), SEEDS)
@settings(max_examples=60)
def test_wheels_accelerate_like_rotors_on_hinges(n: int, count: int, seed: int) -> None:
    """Of any mass, anywhere in the base, at some 1000 rpm; some are held by brakes.

    With the brakes' torques as forces on what is free, the bodies accelerate all the same.
    """
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, n)
    rotors = random_rotors(rng, robot, count)
    state = random_state(rng, n)._replace(
        theta=rng.uniform(-np.pi, np.pi, n + count),
        rate=np.concatenate([rng.normal(size=n), 100.0 * rng.normal(size=count)]),
    )
    model, force = robot.model.copy(), rng.normal(size=6 + n + count)
    mount(model, rotors)
    locked = np.concatenate([np.zeros(n, bool), rng.random(count) < 0.4])
    found, holding = accelerate(model, n, state, state.theta[:n], state.rate, force, locked)
    assert not found[6:][locked].any()
    force[6:] -= np.where(locked, holding, 0.0)
    bodies = pinocchio_with_wheels(robot, rotors)
    size = np.abs(accelerate(model, n, state, state.theta[:n], state.rate, force, locked)[0]).max()
    expected = pinocchio_acceleration(bodies, bodies.createData(), state, force)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11 * (1.0 + size))


@given(st.sampled_from([1, 2, 3, 6, 7, 0, 0]), st.sampled_from([0.0, 0.4]), SEEDS)
@settings(max_examples=120)
def test_motors_accelerate_like_bodies_on_links(n: int, share: float, seed: int) -> None:
    """In chains of ``n`` joints, or in a tree; each rotor's own acceleration. Some are held."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, n) if n else Robot.from_tree(random_tree(rng, TREE))
    robot = random_gears(rng, robot)
    rotors, n, scale = random_motor_rotors(rng, robot), robot.joint_count, turns(robot)
    count, state, model = len(rotors), random_state(rng, n), mounted(robot)
    spins = 100.0 * rng.normal(size=count) / scale[6 + n :]
    force = rng.normal(size=scale.size) * scale
    rows = [*model.row[:n].astype(int), *range(n, n + count)]  # of the model, by joint

    def found(locked: Array) -> tuple[Array, Array]:
        theta, rates = np.empty(n), np.empty(n + count)
        theta[rows[:n]], rates[rows] = state.theta, np.concatenate([state.rate, spins])
        given, brakes = force.copy(), np.empty(locked.size, bool)
        given[6:][rows], brakes[rows] = force[6:], locked
        out, holding = accelerate(model, robot.n, state, theta, rates, given, brakes)
        return np.concatenate([out[:6], out[6:][rows]]), holding[rows]

    free, _ = found(np.zeros(n + count, bool))
    locked = rng.random(n + count) < share
    actual, holding = found(locked)
    assert not actual[6:][locked].any()
    force[6:] -= np.where(locked, holding, 0.0)
    expected = RotorEquations(robot, rotors).accelerations(state, spins, force)
    size = np.abs(free * scale).max() + np.abs(expected * scale).max()
    np.testing.assert_allclose(actual * scale, expected * scale, rtol=0.0, atol=1e-11 * size)


# The model as a linear function of second moments of mass, and these moments


def near_zero(case: Case) -> Array:
    """The attitude of a case, nearer to zero than half a turn: there J0^-1 would be large."""
    quaternion = case.state.quaternion.copy()
    quaternion[0] = abs(quaternion[0]) + 0.1
    return quaternion / np.linalg.norm(quaternion)


STILL = np.zeros((2, 3))
"""omega_d and alpha_d of a desired frame at rest."""


def model_of(
    robot: Robot, quaternion: Array, theta: Array, rate: Array, frame: Array = STILL
) -> tuple[Array, Array]:
    """H_S and c_S of the project for ``rho = [eps_e, theta]`` with ``rhodot = rate``."""
    out, back = RhoSpaceModel.allocate(robot.n), rotation_of(quaternion).inv()
    relative_omega = np.linalg.solve(attitude_jacobian_base(quaternion), rate[:3])
    omega_base = relative_omega + back.apply(frame[0])
    rho_space_into(robot.model, quaternion, theta, omega_base, rate[3:].copy(), *frame, out)
    return out.inertia.copy(), out.bias.copy()


def relative(actual: Array, expected: Array) -> float:
    """Largest difference, relative to the largest number."""
    return float(np.abs(actual - expected).max() / np.abs(expected).max())


def by_sweep(
    case: Case, moments: Array, quaternion: Array, motion: Array, frame: Array = STILL
) -> tuple[Array, Array]:
    """``Y pi`` and ``(J s)^T (J vdot + Jdot v)`` by the kernels, for rate, s, v and vdot."""
    robot, work = case.robot, Regressor.allocate(case.robot.n)
    force = np.zeros(robot.n + 3)
    vectors_into(robot.model, quaternion, case.state.theta, work)
    rate, s, v, v_rate = motion
    take_rho(quaternion, *frame, rate, s, v, v_rate, work)
    motions_into(robot.model, work)
    force_on_vectors_into(robot.model, np.array(work.acceleration) @ moments, work, force)
    force_in_rho(work, force)
    product = np.array(work.sliding).T @ np.array(work.acceleration)
    return force, 0.5 * (product + product.T)


def on_outer_axes(quaternion: Array, rate: Array, v: Array, v_rate: Array) -> tuple[Array, Array]:
    """A velocity in rho and its rate as ``[w, thetadot]`` relative to the desired frame."""
    jacobian, jacobian_rate = np.eye(rate.size), np.zeros((rate.size, rate.size))
    j0 = jacobian[:3, :3] = attitude_jacobian_inertial(quaternion)
    eta_rate = -0.5 * quaternion[1:] @ np.linalg.solve(j0, rate[:3])
    jacobian_rate[:3, :3] = 0.5 * (eta_rate * np.eye(3) - skew(rate[:3]))
    velocity = np.linalg.solve(jacobian, v)
    return velocity, np.linalg.solve(jacobian, v_rate - jacobian_rate @ velocity)


@FEW
@given(cases() | branched_cases())
def test_force_in_a_moving_frame_is_that_of_dense_jacobians_on_outer_axes(case: Case) -> None:
    """``w0 = J0^-1 v + omega_d``; its rate, inertial but on the turning axes, adds
    ``alpha_d + omega_d x (J0^-1 v)``. Also for velocities that the robot does not have."""
    robot, rng = case.robot, case.rng
    quaternion, size = near_zero(case), 2 * robot.n + 3
    frame, motion = rng.normal(size=(2, 3)), rng.normal(size=(4, robot.n + 3))
    rate, s, v, v_rate = motion
    root = rng.normal(size=(size, size))
    moments = root @ root.T
    force, gradient = by_sweep(case, moments, quaternion, motion, frame)
    w, _ = on_outer_axes(quaternion, rate, rate, v_rate)
    wv, a = on_outer_axes(quaternion, rate, v, v_rate)
    a[:3] += frame[1] + np.cross(frame[0], wv[:3])
    for velocity in (w, wv):
        velocity[:3] += frame[0]
    dense = jacobians(robot, quaternion, case.state.theta, w, in_rho=False)
    expected = dense.force(moments, wv, a)
    j0 = attitude_jacobian_inertial(quaternion)
    expected[:3] = np.linalg.solve(j0.T, expected[:3])
    assert relative(force, expected) < 1e-11
    slide = s.copy()
    slide[:3] = np.linalg.solve(j0, s[:3])
    assert relative(gradient, dense.gradient(slide, wv, a)) < 1e-11


@FEW
@given(cases() | branched_cases())
def test_in_a_moving_frame_the_nominal_moments_give_the_model(case: Case) -> None:
    """``Y pi = H_S rhodd + c_S`` for the robot's own motion, as `rho_space_into` has them."""
    robot, rng = case.robot, case.rng
    quaternion, moments = near_zero(case), second_moments(robot)
    frame, (rate, acceleration) = rng.normal(size=(2, 3)), rng.normal(size=(2, robot.n + 3))
    inertia, bias = model_of(robot, quaternion, case.state.theta, rate, frame)
    motion = np.array([rate, rate, rate, acceleration])
    force, _ = by_sweep(case, moments, quaternion, motion, frame)
    assert relative(force, inertia @ acceleration + bias) < 1e-11
    force, _ = by_sweep(case, moments, quaternion, motion)
    assert relative(force, inertia @ acceleration + bias) > 1e-6


@FEW
@given(cases() | branched_cases())
def test_moments_with_factors_are_those_of_a_robot_of_such_masses(case: Case) -> None:
    robot, factors = case.robot, case.rng.uniform(0.1, 2.0, case.robot.n + 1)
    inertia = factors[:, None, None] * robot.inertia
    expected = second_moments(replace(robot, mass=factors * robot.mass, inertia=inertia))
    slides = np.flatnonzero(robot.is_prismatic)
    expected[4 + 2 * slides, 4 + 2 * slides] = factors[1 + slides]  # of vectors that are zero
    assert relative(second_moments(robot, factors), expected) < 1e-13
