"""The model as a linear function of second moments of mass, and these moments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import attitude_jacobian_base, attitude_jacobian_inertial, rotation_of, skew
from oracles.second_moments import jacobians, missing, second_moments
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
SMALLEST_ETA = 0.1


def near_zero(case: Case, least: float = SMALLEST_ETA) -> Array:
    """The attitude of a case, nearer to zero than half a turn: there J0^-1 would be large."""
    quaternion = case.state.quaternion.copy()
    quaternion[0] = abs(quaternion[0]) + least
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


def pseudo_inertia(robot: Robot, i: int) -> Array:
    """(4, 4) integral of ``[x, 1] [x, 1]^T dm`` of a body in its frame."""
    com = np.zeros(3) if i == 0 else robot.com[i]
    second = 0.5 * np.trace(robot.inertia[i]) * np.eye(3) - robot.inertia[i]
    moment = robot.mass[i] * com
    second = second + np.outer(moment, com)
    return np.block([[second, moment[:, None]], [moment[None], np.array([[robot.mass[i]]])]])


def deviated(robot: Robot, spread: Array, rng: np.random.Generator) -> Robot:
    """Every link's pseudo-inertia off by up to its ``spread`` in any direction; the base scaled."""
    masses, inertias, coms = robot.mass.copy(), robot.inertia.copy(), robot.com.copy()
    scale = 1.0 + spread[0] * rng.uniform(-1, 1)
    masses[0], inertias[0] = scale * masses[0], scale * inertias[0]
    for i in range(1, robot.n + 1):
        axes, _ = np.linalg.qr(rng.normal(size=(4, 4)))
        root = np.linalg.cholesky(pseudo_inertia(robot, i))
        factor = axes @ np.diag(1.0 + spread[i] * rng.uniform(-1, 1, 4)) @ axes.T
        p = root @ factor @ root.T
        masses[i], coms[i] = p[3, 3], p[:3, 3] / p[3, 3]
        second = p[:3, :3] - masses[i] * np.outer(coms[i], coms[i])
        inertias[i] = np.trace(second) * np.eye(3) - second
    return replace(robot, mass=masses, inertia=inertias, com=coms)


@FEW
@given(cases() | branched_cases(), st.floats(0.01, 0.95))
def test_moments_lie_between_those_of_the_lightest_and_heaviest_robot(
    case: Case, most: float
) -> None:
    spread = most * case.rng.uniform(0.1, 1.0, case.robot.n + 1)
    moments = second_moments(deviated(case.robot, spread, case.rng))
    lower, upper = (second_moments(case.robot, 1.0 + side * spread) for side in (-1.0, 1.0))
    for k in missing(case.robot):
        moments[k, k] = 1.0
    for difference in (moments - lower, upper - moments, lower):
        size = np.sqrt(np.diag(upper))
        assert np.linalg.eigvalsh(difference / np.outer(size, size))[0] > -1e-12
    assert np.linalg.eigvalsh(lower)[0] > 0.0
