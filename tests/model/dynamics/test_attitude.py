"""Quaternion kinematics by SciPy; H_S and c_S of (25), (28) in a frame that moves anyhow."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from hypothesis import assume, given, settings
from numpy.typing import NDArray
from oracles import RelativeMotion, attitude_jacobian_inertial, multiplied, rotation_of, turned
from strategies import RNGS, Case, State, branched_cases, cases, random_quaternion

from space_robot_model.dynamics.attitude import (
    attitude_jacobian,
    attitude_jacobian_inverse,
    quaternion_rate,
    rotation_matrix,
)
from space_robot_model.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import forward_dynamics

Array = NDArray[np.float64]


def written(kernel: Callable[..., None], shape: tuple[int, ...], *arguments: Array) -> Array:
    """What ``kernel`` writes into its last argument."""
    out = np.full(shape, np.nan)
    kernel(*arguments, out)
    return out


def matrix_of(quaternion: Array) -> Array:
    return written(rotation_matrix, (3, 3), quaternion)


def j0_of(quaternion: Array) -> Array:
    return written(attitude_jacobian, (3, 3), quaternion)


@given(RNGS)
def test_quaternion_rate_is_the_derivative_of_a_turn_on_inertial_axes(
    rng: np.random.Generator,
) -> None:
    """Central difference of SciPy's ``exp(w t) q`` at any attitude."""
    q, omega_inertial, step = random_quaternion(rng), rng.normal(size=3), 1e-6
    ahead, behind = turned(q, step * omega_inertial), turned(q, -step * omega_inertial)
    rate = written(quaternion_rate, (4,), q, omega_inertial)
    np.testing.assert_allclose(rate, (ahead - behind) / (2 * step), atol=1e-9)


@given(RNGS)
def test_rate_from_inertial_and_from_base_angular_velocity_is_the_same(
    rng: np.random.Generator,
) -> None:
    """epsdot = J0(base) R^T w = quaternion_rate(w): a frame mix-up shows at large angles."""
    q, omega_inertial = random_quaternion(rng), rng.normal(size=3)
    omega_base = rotation_of(q).inv().apply(omega_inertial)
    rate = written(quaternion_rate, (4,), q, omega_inertial)
    np.testing.assert_allclose(j0_of(q) @ omega_base, rate[1:], atol=1e-15)
    np.testing.assert_allclose(-0.5 * q[1:] @ omega_base, rate[0], atol=1e-15)
    np.testing.assert_allclose(attitude_jacobian_inertial(q) @ omega_inertial, rate[1:], atol=1e-15)


def test_the_two_frames_differ_away_from_the_identity() -> None:
    """A quarter turn about x: base y is inertial z, so the same numbers mean another motion."""
    q, omega = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    from_inertial = written(quaternion_rate, (4,), q, omega)[1:]
    np.testing.assert_allclose(from_inertial, [0.0, np.sqrt(0.125), -np.sqrt(0.125)], atol=1e-15)
    np.testing.assert_allclose(j0_of(q) @ omega, [0.0, np.sqrt(0.125), np.sqrt(0.125)], atol=1e-15)


@given(RNGS)
def test_inverse_jacobian_inverts(rng: np.random.Generator) -> None:
    """Both ways and against NumPy, up to 179.9 degrees."""
    q = random_quaternion(rng)
    assume(abs(q[0]) > 1e-3)
    inverse = written(attitude_jacobian_inverse, (3, 3), q)
    tolerance = 1e-13 / abs(q[0])
    np.testing.assert_allclose(inverse @ j0_of(q), np.eye(3), atol=tolerance)
    np.testing.assert_allclose(j0_of(q) @ inverse, np.eye(3), atol=tolerance)
    np.testing.assert_allclose(inverse, np.linalg.inv(j0_of(q)), rtol=1e-9, atol=tolerance)


@given(RNGS)
def test_rotation_matrix_agrees_with_scipy(rng: np.random.Generator) -> None:
    q = random_quaternion(rng)
    np.testing.assert_allclose(matrix_of(q), rotation_of(q).as_matrix(), atol=1e-15)
    np.testing.assert_array_equal(matrix_of(-q), matrix_of(q))


FEW = settings(max_examples=40)
CLOSEST_ETA = 0.05
"""|eta| of random attitudes; from 174 degrees on, J0^-1 magnifies rounding too much to compare."""


class Frame(NamedTuple):
    """Where a desired frame is and how it turns; its rates are on its own axes."""

    quaternion: Array
    omega: Array
    alpha: Array


STILL = Frame(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))


def random_frame(rng: np.random.Generator) -> Frame:
    return Frame(random_quaternion(rng), rng.normal(size=3), rng.normal(size=3))


def rho_space(robot: Robot, s: State, frame: Frame = STILL) -> tuple[Array, Array]:
    """H_S and c_S by the code under test; the state's inertial axes are those of the frame."""
    out = RhoSpaceModel.allocate(robot.n)
    omega_base = rotation_of(s.quaternion).inv().apply(s.w0)
    moving = frame.omega, frame.alpha
    rho_space_into(robot.model, s.quaternion, s.theta, omega_base, s.rate, *moving, out)
    return out.inertia, out.bias


def second_rate(frame: Frame, s: State, acceleration: Array) -> Array:
    """epsdd of ``q_e = q_d* q`` by the product rule of quaternions.

    The base's ``acceleration`` (3,) is inertial, on the frame's axes, as all of ``s``.
    """

    to_inertial = rotation_of(frame.quaternion)
    inertial = s._replace(
        quaternion=multiplied(frame.quaternion, s.quaternion), w0=to_inertial.apply(s.w0)
    )
    motion = RelativeMotion.of(np.concatenate(frame), inertial)
    side = np.sign(motion.error @ s.quaternion)
    return side * motion.second_rate(to_inertial.apply(acceleration))


def block_diagonal(corner: Array, size: int, rest: float) -> Array:
    matrix = rest * np.eye(size)
    matrix[:3, :3] = corner
    return matrix


def residual_in(frame: Frame, told: Frame, case: Case) -> float:
    """Of ``H_S epsdd_e + c_S = F_S`` where the frame moves, relative to its largest term.

    The robot moves as `forward_dynamics` has it on inertial axes; the model is ``told`` of a frame.
    """
    robot, s, rng = case
    torque = 50.0 * rng.normal(size=robot.n + 3)
    force = np.concatenate([np.zeros(3), torque])
    quaternion = multiplied(frame.quaternion, s.quaternion)
    to_inertial = rotation_of(frame.quaternion)
    force[3:6] = to_inertial.apply(force[3:6])
    w0 = to_inertial.apply(s.w0)
    acceleration = forward_dynamics(robot, quaternion, s.theta, w0, s.rate, force)[3:]
    rho_acceleration = acceleration.copy()
    rho_acceleration[:3] = second_rate(frame, s, to_inertial.inv().apply(acceleration[:3]))
    inertia, bias = rho_space(robot, s, told)
    jacobian = block_diagonal(attitude_jacobian_inertial(s.quaternion), robot.n + 3, 1.0)
    expected = np.linalg.solve(jacobian.T, torque)
    scale = (np.abs(inertia) @ np.abs(rho_acceleration) + np.abs(bias) + np.abs(expected)).max()
    return float(np.abs(inertia @ rho_acceleration + bias - expected).max() / scale)


@FEW
@given(cases() | branched_cases())
def test_model_explains_the_motion_relative_to_a_frame_that_moves_anyhow(case: Case) -> None:
    """And not without ``b = alpha_d + omega_d x w_e``, nor with half of it."""
    assume(abs(case.state.quaternion[0]) > CLOSEST_ETA)
    frame = random_frame(case.rng)
    assert residual_in(frame, frame, case) < 1e-10
    for told in (
        STILL,
        frame._replace(alpha=np.zeros(3)),
        frame._replace(omega=np.zeros(3)),
        frame._replace(omega=-frame.omega),
    ):
        assert residual_in(frame, told, case) > 1e-5
