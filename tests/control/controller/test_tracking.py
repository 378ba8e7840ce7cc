"""From measured and desired motion to q_e, e, edot, rhodd_d, at any attitude."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import attitude_jacobian_base, quaternion_of, rotation_of
from random_robots import JOINTS, random_quaternion
from scipy.spatial.transform import Rotation

from space_robot_control.controller.tracking import (
    force_from_torque,
    relative_rate,
    show_state,
    torque_from_force,
    tracking_errors,
)
from space_robot_control.laws import Signals
from space_robot_model.dynamics.attitude import attitude_error_into, attitude_jacobian_inverse
from space_robot_msgs_py.samples import ReferenceChunk, State

Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


class Errors(NamedTuple):
    e: Array
    edot: Array
    rhodd_d: Array


class Base(NamedTuple):
    """Attitude and rates of a frame, on its own axes."""

    quaternion: Array
    omega: Array
    alpha: Array


def random_base(rng: np.random.Generator) -> Base:
    return Base(random_quaternion(rng), rng.normal(size=3), rng.normal(size=3))


def error_of(desired: Array, actual: Array, near: Array | None = None) -> Array:
    """q_e by the code under test."""
    out = np.zeros(4) if near is None else near.copy()
    attitude_error_into(desired, actual, out)
    return out


def rate_of(error: Array, base: Base, desired: Base, joint_velocities: Array) -> Array:
    """rhodot by the code under test."""
    rate, to_base = np.zeros(len(joint_velocities) + 3), rotation_of(error).inv()
    omega_desired = to_base.apply(desired.omega)
    jacobian, scratch = attitude_jacobian_base(error), np.zeros(3)
    relative_rate(base.omega, joint_velocities, omega_desired, jacobian, scratch, rate)
    return rate


def errors_of(error: Array, theta: Array, rate: Array, joints: Array) -> Errors:
    n = len(theta)
    state, signals = State.allocate(n), Signals.allocate(n)
    state.joint_positions[:], signals.rho_rate[:] = theta, rate
    signals.attitude_error[:] = error
    for column in (signals.error, signals.error_rate, signals.acceleration_desired):
        column[:] = np.nan
    base = np.concatenate([random_quaternion(np.random.default_rng(1)), np.ones(6)])
    (reference,) = ReferenceChunk(0, joints[None], base[None]).references()
    show_state(state, reference, signals)
    tracking_errors(state, reference, signals)
    return Errors(signals.error, signals.error_rate, signals.acceleration_desired)


def at(base: Base, time: float) -> Rotation:
    """The frame a little later, by SciPy's rotations."""
    return rotation_of(base.quaternion) * Rotation.from_rotvec(
        base.omega * time + base.alpha * (0.5 * time * time)
    )


@given(seeds)
def test_error_is_the_rotation_from_the_desired_attitude(rng: np.random.Generator) -> None:
    """By SciPy, from the base to the desired frame; of two quaternions that with eta >= 0."""
    desired, actual = random_quaternion(rng), random_quaternion(rng)
    expected = quaternion_of(rotation_of(desired).inv() * rotation_of(actual))
    expected *= np.copysign(1.0, expected[0])
    np.testing.assert_allclose(error_of(desired, actual), expected, atol=1e-14)
    turn = random_quaternion(rng)  # of the inertial frame makes no difference
    turned = [quaternion_of(rotation_of(turn) * rotation_of(q)) for q in (desired, actual)]
    np.testing.assert_allclose(error_of(*turned), expected, atol=1e-14)


@given(seeds)
def test_error_stays_on_the_side_of_the_last_one(rng: np.random.Generator) -> None:
    """Whatever the signs of measurement and reference, to the bit: rho must not jump."""
    desired, actual, near = (random_quaternion(rng) for _ in range(3))
    error = error_of(desired, actual, near)
    assert error @ near > 0.0
    for a, b in ((-desired, actual), (desired, -actual), (-desired, -actual)):
        np.testing.assert_array_equal(error_of(a, b, near), error)
    np.testing.assert_array_equal(error_of(desired, actual, -near), -error)


def test_error_passes_half_a_turn_without_a_jump() -> None:
    """Turned on and on, eta of q_e follows the cosine of half the angle, below zero, too."""
    desired, axis = random_quaternion(np.random.default_rng(2)), np.array([0.6, 0.0, -0.8])
    error = np.zeros(4)
    for angle in np.linspace(0.0, 4.0 * np.pi, 500):
        attitude = rotation_of(desired) * Rotation.from_rotvec(angle * axis)
        attitude_error_into(desired, quaternion_of(attitude), error)
        expected = [np.cos(angle / 2), *(np.sin(angle / 2) * axis)]
        np.testing.assert_allclose(error, expected, atol=1e-14)


@given(seeds, st.sampled_from(JOINTS))
def test_rate_is_that_of_the_error(rng: np.random.Generator, n: int) -> None:
    """epsdot_e by a finite difference of base and desired frame, both turning anyhow."""
    base, desired, joint_velocities = random_base(rng), random_base(rng), rng.normal(size=n)
    error = error_of(desired.quaternion, base.quaternion)
    rate, step = rate_of(error, base, desired, joint_velocities), 1e-6
    ahead, behind = (
        error_of(quaternion_of(at(desired, h)), quaternion_of(at(base, h)), error)
        for h in (step, -step)
    )
    np.testing.assert_allclose(rate[:3], (ahead - behind)[1:] / (2 * step), atol=1e-8)
    np.testing.assert_array_equal(rate[3:], joint_velocities)


@given(seeds, st.sampled_from(JOINTS))
def test_errors_are_desired_minus_measured(rng: np.random.Generator, n: int) -> None:
    """No attitude error is desired, whatever the desired attitude, its rate and acceleration."""
    error, rate = random_quaternion(rng), rng.normal(size=n + 3)
    theta, joints = rng.normal(size=n), rng.normal(size=(3, n))
    errors = errors_of(error, theta, rate, joints)
    np.testing.assert_array_equal(errors.e, [*-error[1:], *(joints[0] - theta)])
    np.testing.assert_array_equal(errors.edot, [*-rate[:3], *(joints[1] - rate[3:])])
    np.testing.assert_array_equal(errors.rhodd_d, [*np.zeros(3), *joints[2]])


def test_no_error_where_measured_is_desired() -> None:
    rng = np.random.default_rng(1)
    desired, joints = random_base(rng), rng.normal(size=(3, 4))
    base = desired._replace(quaternion=-desired.quaternion)
    error = error_of(desired.quaternion, base.quaternion)
    rate = rate_of(error, base, desired, joints[1])
    errors = errors_of(error, joints[0], rate, joints)
    np.testing.assert_allclose(errors.e, np.zeros(7), atol=1e-16)
    np.testing.assert_allclose(errors.edot, np.zeros(7), atol=1e-15)


@given(seeds, st.sampled_from(JOINTS))
def test_force_and_torque_do_the_same_work(rng: np.random.Generator, n: int) -> None:
    """tau = J^T F_S, so F_S.rhodot = tau.[omega_e, thetadot] at any rate."""
    q, omega, joint_velocities = random_quaternion(rng), rng.normal(size=3), rng.normal(size=n)
    force, torque = rng.normal(size=n + 3), np.zeros(n + 3)
    jacobian = attitude_jacobian_base(q)
    rate = np.concatenate([jacobian @ omega, joint_velocities])
    torque_from_force(jacobian, force, torque)
    np.testing.assert_allclose(torque[:3], attitude_jacobian_base(q).T @ force[:3], atol=1e-14)
    work = torque[:3] @ omega + torque[3:] @ joint_velocities
    assert force @ rate == pytest.approx(work, abs=1e-12)


@given(seeds, st.sampled_from(JOINTS))
def test_force_from_torque_inverts_torque_from_force(rng: np.random.Generator, n: int) -> None:
    q = random_quaternion(rng)
    assume(abs(q[0]) > 0.01)
    force, torque, back = rng.normal(size=n + 3), np.zeros(n + 3), np.zeros(n + 3)
    inverse = np.zeros((3, 3))
    attitude_jacobian_inverse(q, inverse)
    torque_from_force(attitude_jacobian_base(q), force, torque)
    force_from_torque(inverse, torque, back)
    np.testing.assert_allclose(back, force, rtol=1e-10, atol=1e-12 / abs(q[0]))
