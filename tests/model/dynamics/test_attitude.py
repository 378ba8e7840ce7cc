"""Quaternion kinematics by SciPy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import assume, given
from oracles import attitude_jacobian_inertial, rotation_of, turned
from strategies import RNGS, random_quaternion

from space_robot_model.dynamics.attitude import (
    attitude_jacobian,
    attitude_jacobian_inverse,
    quaternion_rate,
    rotation_matrix,
)
from space_robot_model.elementary.matrices import Array


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
