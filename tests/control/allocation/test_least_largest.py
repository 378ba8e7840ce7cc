"""Least largest load: a linear programme's optimum, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog
from wheel_layouts import PYRAMID, unit, wheel_set

from space_robot_control.allocation.least_largest import least_largest
from space_robot_msgs_py.samples import MOST_WHEELS

Array = NDArray[np.float64]

CUBE = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]])
LAYOUTS = {
    "orthogonal": CUBE,
    "orthogonal and one": np.vstack([CUBE, [[1, 1, 1]]]),
    "pyramid": PYRAMID,
    "twice": np.vstack([CUBE, CUBE]),
    "twice, against": np.vstack([CUBE, -CUBE]),
    "three in a plane": np.vstack([CUBE, [[1, 1, 0], [1, -2, 0]]]),
    "five in a plane": np.array(
        [[1, 0, 0], [0, 1, 0], [1, 1, 0], [2, -1, 0], [1, 3, 0], [0, 0, 1]]
    ),
    "three parallel": np.array([[1, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    "eight": np.vstack([PYRAMID, CUBE, [[1, 1, 1]]]),
}


def loads_of(axes: Array, full: Array, wanted: Array, out: tuple[int, ...] = ()) -> Array:
    torque = np.zeros(MOST_WHEELS)
    least_largest(wheel_set(axes, full, out), len(axes), wanted, torque)
    return np.asarray(torque[: len(axes)] / full)


def least(axes: Array, full: Array, wanted: Array) -> float:
    """By linear programming: min t with A u = wanted, -t <= u_k / full_k <= t."""
    count = len(axes)
    columns = np.hstack([unit(axes).T * full, np.zeros((3, 1))])
    bounds = np.vstack([np.hstack([s * np.eye(count), -np.ones((count, 1))]) for s in (1, -1)])
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=bounds,
        b_ub=np.zeros(2 * count),
        A_eq=columns,
        b_eq=wanted,
        bounds=[(None, None)] * count + [(0, None)],
        method="highs",
    )
    assert found.success
    return float(found.fun)


def check(axes: Array, full: Array, wanted: Array) -> None:
    loads = loads_of(axes, full, wanted)
    np.testing.assert_allclose(
        unit(axes).T @ (loads * full), wanted, rtol=0.0, atol=1e-13 * np.abs(full).max() * 100
    )
    largest = np.abs(loads).max()
    assert largest == pytest.approx(least(axes, full, wanted), rel=1e-6, abs=1e-9)
    squares = np.linalg.pinv(unit(axes).T * full) @ wanted
    assert largest <= np.abs(squares).max() * (1.0 + 1e-9)


@pytest.mark.parametrize("name", LAYOUTS)
def test_layouts_of_wheels(name: str) -> None:
    axes, rng = LAYOUTS[name], np.random.default_rng(3)
    wanted = [*rng.normal(size=(15, 3)), *np.eye(3), *(-np.eye(3)), *axes, np.ones(3)]
    for full in (np.ones(len(axes)), rng.uniform(0.2, 3.0, len(axes))):
        for one in wanted:
            check(axes, full, np.asarray(one, dtype=float))


@pytest.mark.parametrize("count", [3, 4, 5, 8])
def test_random_wheels(count: int) -> None:
    rng = np.random.default_rng(count)
    for _ in range(25):
        check(rng.normal(size=(count, 3)), rng.uniform(0.1, 10.0, count), rng.normal(size=3))


def test_nearly_parallel_wheels_give_the_torque() -> None:
    rng = np.random.default_rng(5)
    for tilt in (1e-4, 1e-7, 1e-10, 1e-13):
        axes = np.vstack([CUBE, CUBE + tilt * rng.normal(size=(3, 3))])
        for wanted in rng.normal(size=(10, 3)):
            loads = loads_of(axes, np.ones(6), wanted)
            np.testing.assert_allclose(unit(axes).T @ loads, wanted, atol=1e-12)
            assert np.abs(loads).max() == pytest.approx(least(axes, np.ones(6), wanted), rel=1e-5)


def test_pyramid_reaches_what_least_squares_do_not() -> None:
    """A torque along one wheel: the two across it help."""
    wanted = np.array([1.0, 0.0, 0.5])
    squares = np.linalg.pinv(unit(PYRAMID).T) @ wanted
    assert np.abs(loads_of(PYRAMID, np.ones(4), wanted)).max() < 0.95 * np.abs(squares).max()


def test_nothing_wanted_is_nothing() -> None:
    np.testing.assert_array_equal(loads_of(PYRAMID, np.ones(4), np.zeros(3)), 0.0)


def test_wheel_that_is_out_stays_out() -> None:
    loads = loads_of(np.vstack([PYRAMID, [[0, 0, 1]]]), np.ones(5), np.ones(3), out=(2,))
    assert loads[2] == 0.0
    assert np.abs(loads[[0, 1, 3, 4]]).min() > 0.0
