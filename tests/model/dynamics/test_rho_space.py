"""H_S and c_S of (25), (28) against their formulas in dense NumPy, far from the identity.

The desired frame stands still, or moves anyhow.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given, settings
from numpy.typing import NDArray
from oracles import (
    RelativeMotion,
    attitude_jacobian_inertial,
    multiplied,
    quaternion_of,
    rotation_of,
    skew,
    turned,
)
from random_robots import Case, State, branched_cases, cases, random_quaternion, random_state
from scipy.spatial.transform import Rotation

from space_robot_model.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import bias_force, forward_dynamics, mass_matrix

Array = NDArray[np.float64]

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


def test_second_rate_agrees_with_a_finite_difference_of_a_motion() -> None:
    """The product rule used above, by SciPy's rotations of base and frame."""
    rng, h = np.random.default_rng(5), 1e-3
    for _ in range(20):
        frame, s, wdot = random_frame(rng), random_state(rng, 1), rng.normal(size=3)

        def epsilon(t: float, frame: Frame = frame, s: State = s, wdot: Array = wdot) -> Array:
            turn_d = Rotation.from_rotvec(t * frame.omega + 0.5 * t * t * frame.alpha)
            turn = Rotation.from_rotvec(t * s.w0 + 0.5 * t * t * wdot)  # on the first frame's axes
            at = quaternion_of(turn_d.inv() * turn * rotation_of(s.quaternion))
            return at[1:] if at @ s.quaternion > 0.0 else -at[1:]

        second = (epsilon(-h) - 2.0 * epsilon(0.0) + epsilon(h)) / h**2
        np.testing.assert_allclose(second_rate(frame, s, wdot), second, atol=1e-5)


@FEW
@given(cases())
def test_with_no_error_the_model_is_that_of_the_desired_motion(case: Case) -> None:
    """As desired, ``F_S = 2 tau`` of the base's own acceleration, whatever omega_d."""
    robot, s, rng = case
    frame = random_frame(rng)
    upright = s._replace(quaternion=STILL.quaternion, w0=frame.omega)
    inertia, bias = rho_space(robot, upright, frame)
    h_r, c_r = reduced(robot, upright)
    stretch = np.diag([2.0] * 3 + [1.0] * robot.n)
    assert_relative(inertia, stretch @ h_r @ stretch, 1e-12)
    assert_relative(bias, stretch @ (c_r + h_r[:, :3] @ frame.alpha), 1e-12)


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
