"""The model as a linear function of second moments of mass, and these moments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from numpy.typing import NDArray
from oracles import attitude_jacobian_base, attitude_jacobian_inertial, rotation_of, skew
from oracles.second_moments import jacobians, second_moments
from strategies import Case, branched_cases, cases

from space_robot_model.dynamics.regressor import (
    Regressor,
    force_in_rho,
    force_on_vectors_into,
    motions_into,
    take_rho,
    vectors_into,
)
from space_robot_model.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_model.robot import Robot

Array = NDArray[np.float64]
FEW = settings(max_examples=25, deadline=None)


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
