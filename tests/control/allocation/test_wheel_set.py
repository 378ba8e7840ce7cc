"""Tables of the wheels that take part: least squares, what is beyond them, null space."""

from __future__ import annotations

import numpy as np
import pytest
from wheel_layouts import PYRAMID, unit, wheel_set


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6, 8])
def test_inverse_is_that_of_weighted_least_squares(count: int) -> None:
    rng = np.random.default_rng(count)
    for _ in range(20):
        axes, loads = rng.normal(size=(count, 3)), rng.uniform(0.05, 5.0, count)
        wheels = wheel_set(axes, loads)
        expected = np.diag(loads) @ np.linalg.pinv(unit(axes).T @ np.diag(loads))
        np.testing.assert_allclose(wheels.inverse[:count], expected, rtol=1e-6, atol=1e-9)
        assert wheels.rank == min(count, 3)
        spanned = np.linalg.pinv(unit(axes)) @ unit(axes)
        np.testing.assert_allclose(wheels.beyond, np.eye(3) - spanned, atol=1e-7)


def test_wheel_that_is_out_takes_no_torque() -> None:
    wheels = wheel_set(PYRAMID, out=(1,))
    assert wheels.rank == 3
    expected = np.linalg.inv(unit(PYRAMID[[0, 2, 3]]).T)
    np.testing.assert_allclose(wheels.inverse[[0, 2, 3]], expected, atol=1e-12)
    np.testing.assert_array_equal(wheels.inverse[1], 0.0)
    np.testing.assert_array_equal(wheels.null, 0.0)


def test_two_wheels_leave_an_axis_beyond_them() -> None:
    wheels = wheel_set(PYRAMID, out=(1, 3))
    assert wheels.rank == 2
    np.testing.assert_allclose(wheels.beyond, np.diag([0.0, 1.0, 0.0]), atol=1e-12)


def test_no_wheels_leave_all() -> None:
    wheels = wheel_set(PYRAMID, out=(0, 1, 2, 3))
    assert wheels.rank == 0
    np.testing.assert_array_equal(wheels.beyond, np.eye(3))
    np.testing.assert_array_equal(wheels.inverse, 0.0)


@pytest.mark.parametrize("count", [4, 5, 6, 8])
def test_null_vector_moves_wheels_and_no_base(count: int) -> None:
    rng = np.random.default_rng(count)
    for _ in range(10):
        axes = rng.normal(size=(count, 3))
        null = wheel_set(axes, rng.uniform(0.5, 2.0, count)).null[:count]
        assert np.abs(null).max() == pytest.approx(1.0)
        np.testing.assert_allclose(unit(axes).T @ null, 0.0, atol=1e-9)


def test_pyramid_has_wheels_in_turn_against_one_another() -> None:
    np.testing.assert_allclose(np.abs(wheel_set(PYRAMID).null[:4]), 1.0, atol=1e-12)
    assert wheel_set(PYRAMID).null[0] * wheel_set(PYRAMID).null[1] < 0.0
