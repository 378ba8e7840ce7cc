"""Quaternions of the navigation filter against SciPy's rotations."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import quaternion_of, rotation_of
from random_robots import random_quaternion
from scipy.spatial.transform import Rotation

from space_robot_control.navigation.quaternions import is_same, multiply, small_angle, turn

Array = NDArray[np.float64]
seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def vector(rng: np.random.Generator, size: float) -> Array:
    direction = rng.normal(size=3)
    return size * direction / np.linalg.norm(direction)


@given(seeds, st.sampled_from([1e-9, 1e-3, 0.03, 0.1]))
def test_a_turn_is_exact_to_1e_12_of_its_angle(rng: np.random.Generator, angle: float) -> None:
    rotation, out = vector(rng, angle), np.empty(4)
    turn(rotation, out)
    found = rotation_of(out / np.linalg.norm(out)).as_rotvec()
    np.testing.assert_allclose(found, rotation, rtol=0.0, atol=1.2e-12 * angle)
    turn(rotation * 1e6, out)
    assert np.isfinite(out).all()


@given(seeds)
def test_products_are_scipys_whichever_is_overwritten(rng: np.random.Generator) -> None:
    p, q = random_quaternion(rng), random_quaternion(rng)
    expected = quaternion_of(rotation_of(p) * rotation_of(q))
    for left, right in ((p.copy(), 3.0 * q), (2.0 * p, q.copy())):
        for out in (np.empty(4), left, right):
            multiply(left, right, out)
            assert min(np.abs(out - expected).max(), np.abs(out + expected).max()) < 1e-15
            left[:], right[:] = p, q


@given(seeds, st.sampled_from([1e-8, 1e-4, 1e-2]), st.sampled_from([1.0, -1.0]))
def test_a_small_angle_is_the_rotation_between(
    rng: np.random.Generator, angle: float, sign: float
) -> None:
    """To third order, whichever sign; the cosine is that of half of it."""
    origin, rotation, out = random_quaternion(rng), vector(rng, angle), np.empty(3)
    other = sign * quaternion_of(rotation_of(origin) * Rotation.from_rotvec(rotation))
    cosine = small_angle(origin, other, out)
    np.testing.assert_allclose(out, rotation, rtol=0.0, atol=angle**3 / 10.0 + 1e-15)
    assert abs(cosine - np.cos(0.5 * angle)) < 1e-14
    assert small_angle(origin, origin[[1, 0, 3, 2]] * [-1.0, 1.0, 1.0, -1.0], out) < 1e-15


@given(seeds, st.integers(0, 3))
def test_quaternions_are_the_same_with_either_sign_of_all(
    rng: np.random.Generator, place: int
) -> None:
    q = random_quaternion(rng)
    other = q.copy()
    other[place] *= -1.0
    assert is_same(q, q)
    assert is_same(q, -q)
    assert not is_same(q, other)
