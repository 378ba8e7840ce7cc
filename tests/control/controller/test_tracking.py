"""From measured and desired motion to e, edot, rhodd_d, at any attitude."""

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
    measured_rate,
    torque_from_force,
    tracking_errors,
)
from space_robot_control.laws import Signals
from space_robot_model.dynamics.attitude import attitude_jacobian_inverse
from space_robot_msgs_py.samples import ReferenceChunk, State

Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


class Errors(NamedTuple):
    e: Array
    edot: Array
    rhodd_d: Array


def errors_of(quaternion: Array, theta: Array, rate: Array, joints: Array, base: Array) -> Errors:
    n = len(theta)
    state, signals = State.allocate(n), Signals.allocate(n)
    state.joint_positions[:] = theta
    for column in (signals.error, signals.error_rate, signals.acceleration_desired):
        column[:] = np.nan
    (reference,) = ReferenceChunk(0, joints[None], base[None]).references()
    tracking_errors(state, quaternion, rate, reference, np.zeros((3, 3)), signals)
    return Errors(signals.error, signals.error_rate, signals.acceleration_desired)


def rate_of(
    quaternion: Array, omega_base: Array, joint_velocities: Array, jacobian: Array
) -> Array:
    """rhodot; J0 is written into ``jacobian``."""
    state, rate = State.allocate(len(joint_velocities)), np.zeros(len(joint_velocities) + 3)
    state.omega_base[:], state.joint_velocities[:] = omega_base, joint_velocities
    measured_rate(state, quaternion, jacobian, rate)
    return rate


def epsilon_along(base: Array, time: float) -> Array:
    """Vector part of the desired quaternion a little later, by SciPy's rotations."""
    angle = base[4:7] * time + base[7:] * (0.5 * time * time)  # on base axes
    later = quaternion_of(rotation_of(base[:4]) * Rotation.from_rotvec(angle))
    return later[1:] if later @ base[:4] > 0.0 else -later[1:]


def random_base(rng: np.random.Generator) -> Array:
    return np.concatenate([random_quaternion(rng), rng.normal(size=6)])


@given(seeds, st.sampled_from(JOINTS))
def test_measured_rate_is_epsdot_and_thetadot(rng: np.random.Generator, n: int) -> None:
    """epsdot by a finite difference of the attitude; omega in the base frame."""
    base, joint_velocities = random_base(rng), rng.normal(size=n)
    jacobian = np.zeros((3, 3))
    rate = rate_of(base[:4], base[4:7], joint_velocities, jacobian)
    step = 1e-6
    epsilon_rate = (epsilon_along(base, step) - epsilon_along(base, -step)) / (2 * step)
    np.testing.assert_allclose(rate[:3], epsilon_rate, atol=1e-8)
    np.testing.assert_array_equal(rate[3:], joint_velocities)
    np.testing.assert_array_equal(jacobian, attitude_jacobian_base(base[:4]))


@given(seeds, st.sampled_from(JOINTS))
def test_errors_are_desired_minus_measured(rng: np.random.Generator, n: int) -> None:
    """A turning, accelerating base reference: its derivatives by finite differences of eps_d."""
    base, measured = random_base(rng), random_quaternion(rng)
    assume(measured @ base[:4] > 0.0)
    theta, rate, joints = rng.normal(size=n), rng.normal(size=n + 3), rng.normal(size=(3, n))
    errors = errors_of(measured, theta, rate, joints, base)
    step = 1e-3
    behind, now, ahead = (epsilon_along(base, k * step) for k in (-1, 0, 1))
    np.testing.assert_allclose(errors.e, [*(now - measured[1:]), *(joints[0] - theta)])
    first = (ahead - behind) / (2 * step) - rate[:3]
    np.testing.assert_allclose(errors.edot[:3], first, atol=1e-4)
    second = (ahead - 2 * now + behind) / step**2
    np.testing.assert_allclose(errors.rhodd_d[:3], second, atol=1e-4)
    np.testing.assert_array_equal(errors.edot[3:], joints[1] - rate[3:])
    np.testing.assert_array_equal(errors.rhodd_d[3:], joints[2])


@given(seeds)
def test_of_both_desired_quaternions_the_nearer_is_taken(rng: np.random.Generator) -> None:
    """The sign of the reference makes no difference; that of the measurement flips all of eps."""
    base, measured, rate = random_base(rng), random_quaternion(rng), rng.normal(size=5)
    theta, joints = rng.normal(size=2), rng.normal(size=(3, 2))
    other = np.concatenate([-base[:4], base[4:]])
    flip = np.array([-1.0] * 3 + [1.0] * 2)
    expected = errors_of(measured, theta, rate, joints, base)
    for actual, same in zip(errors_of(measured, theta, rate, joints, other), expected, strict=True):
        np.testing.assert_array_equal(actual, same)
    flipped = errors_of(-measured, theta, rate * flip, joints, base)
    for actual, same in zip(flipped, expected, strict=True):
        np.testing.assert_array_equal(actual, same * flip)


def test_no_error_where_measured_is_desired() -> None:
    rng = np.random.default_rng(1)
    base, joints = random_base(rng), rng.normal(size=(3, 4))
    rate = rate_of(-base[:4], base[4:7], joints[1], np.zeros((3, 3)))
    errors = errors_of(-base[:4], joints[0], rate, joints, base)
    np.testing.assert_array_equal(errors.e, np.zeros(7))
    np.testing.assert_array_equal(errors.edot, np.zeros(7))


@given(seeds, st.sampled_from(JOINTS))
def test_force_and_torque_do_the_same_work(rng: np.random.Generator, n: int) -> None:
    """tau = J^T F_S, so F_S.rhodot = tau.[omega_base, thetadot] at any rate."""
    q, omega, joint_velocities = random_quaternion(rng), rng.normal(size=3), rng.normal(size=n)
    force, torque, jacobian = rng.normal(size=n + 3), np.zeros(n + 3), np.zeros((3, 3))
    rate = rate_of(q, omega, joint_velocities, jacobian)
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
