"""Quaternion kinematics: group axioms, frames, and SciPy's Rotation as the oracle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import attitude_jacobian_base, attitude_jacobian_inertial, rotation_of, turned
from random_robots import random_quaternion

from space_robot_model.dynamics.attitude import (
    attitude_jacobian,
    attitude_jacobian_inverse,
    quaternion_rate,
    rotate,
    rotate_back,
    rotation_matrix,
)

Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def written(kernel: Callable[..., None], shape: tuple[int, ...], *arguments: Array) -> Array:
    """What ``kernel`` writes into its last argument."""
    out = np.full(shape, np.nan)
    kernel(*arguments, out)
    return out


def matrix_of(quaternion: Array) -> Array:
    return written(rotation_matrix, (3, 3), quaternion)


def j0_of(quaternion: Array) -> Array:
    return written(attitude_jacobian, (3, 3), quaternion)


def product(p: Array, q: Array) -> Array:
    """Hamilton's product, so that R(p*q) = R(p) R(q)."""
    scalar = p[0] * q[0] - p[1:] @ q[1:]
    return np.array([scalar, *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


@given(seeds)
def test_rotation_matrix_agrees_with_scipy(rng: np.random.Generator) -> None:
    q = random_quaternion(rng)
    np.testing.assert_allclose(matrix_of(q), rotation_of(q).as_matrix(), atol=1e-15)


@given(seeds)
def test_rotation_matrix_is_a_homomorphism(rng: np.random.Generator) -> None:
    """Closure: R(p) R(q) = R(p*q)."""
    p, q = random_quaternion(rng), random_quaternion(rng)
    np.testing.assert_allclose(matrix_of(p) @ matrix_of(q), matrix_of(product(p, q)), atol=1e-14)


def test_identity_quaternion_is_the_identity_matrix() -> None:
    np.testing.assert_array_equal(matrix_of(np.array([1.0, 0.0, 0.0, 0.0])), np.eye(3))


@given(seeds)
def test_conjugate_is_the_inverse_and_the_transpose(rng: np.random.Generator) -> None:
    q = random_quaternion(rng)
    conjugate = q * [1.0, -1.0, -1.0, -1.0]
    np.testing.assert_allclose(matrix_of(conjugate), matrix_of(q).T, atol=1e-15)
    np.testing.assert_allclose(matrix_of(conjugate) @ matrix_of(q), np.eye(3), atol=1e-14)


@given(seeds)
def test_rotations_associate(rng: np.random.Generator) -> None:
    p, q, r = (random_quaternion(rng) for _ in range(3))
    left = matrix_of(product(product(p, q), r))
    np.testing.assert_allclose(left, matrix_of(product(p, product(q, r))), atol=1e-14)


@given(seeds)
def test_rotation_matrix_is_proper_orthogonal(rng: np.random.Generator) -> None:
    matrix = matrix_of(random_quaternion(rng))
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-14)
    assert abs(np.linalg.det(matrix) - 1.0) < 1e-14


@given(seeds)
def test_both_signs_of_a_quaternion_are_one_rotation(rng: np.random.Generator) -> None:
    q = random_quaternion(rng)
    np.testing.assert_array_equal(matrix_of(-q), matrix_of(q))


@given(seeds)
def test_quaternion_rate_is_the_derivative_of_a_turn_on_inertial_axes(
    rng: np.random.Generator,
) -> None:
    """Central difference of SciPy's ``exp(w t) q`` at any attitude."""
    q, omega_inertial, step = random_quaternion(rng), rng.normal(size=3), 1e-6
    ahead, behind = turned(q, step * omega_inertial), turned(q, -step * omega_inertial)
    rate = written(quaternion_rate, (4,), q, omega_inertial)
    np.testing.assert_allclose(rate, (ahead - behind) / (2 * step), atol=1e-9)


@given(seeds)
def test_quaternion_rate_keeps_the_norm(rng: np.random.Generator) -> None:
    q = random_quaternion(rng)
    assert abs(q @ written(quaternion_rate, (4,), q, 10.0 * rng.normal(size=3))) < 1e-14


@given(seeds)
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
    q = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])
    omega = np.array([0.0, 1.0, 0.0])
    from_inertial = written(quaternion_rate, (4,), q, omega)[1:]
    np.testing.assert_allclose(from_inertial, [0.0, np.sqrt(0.125), -np.sqrt(0.125)], atol=1e-15)
    np.testing.assert_allclose(j0_of(q) @ omega, [0.0, np.sqrt(0.125), np.sqrt(0.125)], atol=1e-15)


@given(seeds)
def test_jacobian_is_the_formula_in_the_base_frame(rng: np.random.Generator) -> None:
    q = random_quaternion(rng)
    np.testing.assert_array_equal(j0_of(q), attitude_jacobian_base(q))


@given(seeds)
def test_inverse_jacobian_inverts(rng: np.random.Generator) -> None:
    """Both ways and against NumPy, up to 179.9 degrees."""
    q = random_quaternion(rng)
    assume(abs(q[0]) > 1e-3)
    inverse = written(attitude_jacobian_inverse, (3, 3), q)
    tolerance = 1e-13 / abs(q[0])
    np.testing.assert_allclose(inverse @ j0_of(q), np.eye(3), atol=tolerance)
    np.testing.assert_allclose(j0_of(q) @ inverse, np.eye(3), atol=tolerance)
    np.testing.assert_allclose(inverse, np.linalg.inv(j0_of(q)), rtol=1e-9, atol=tolerance)


@given(seeds)
def test_determinant_of_the_jacobian_vanishes_only_with_eta(rng: np.random.Generator) -> None:
    """det J0 = eta / 8 for a unit quaternion."""
    q = random_quaternion(rng)
    assert abs(np.linalg.det(j0_of(q)) - q[0] / 8.0) < 1e-15


@given(seeds)
def test_rotate_and_rotate_back_are_products_with_the_matrix_and_its_transpose(
    rng: np.random.Generator,
) -> None:
    matrix, vector = rng.normal(size=(3, 3)), rng.normal(size=3)
    np.testing.assert_allclose(written(rotate, (3,), matrix, vector), matrix @ vector, atol=1e-14)
    back = written(rotate_back, (3,), matrix, vector)
    np.testing.assert_allclose(back, matrix.T @ vector, atol=1e-14)
