"""Non-negative least squares, against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls

from space_robot_control.allocation.non_negative import NonNegative, solve
from space_robot_msgs_py.samples import MOST_THRUSTERS

Array = NDArray[np.float64]


def solution(columns: Array, wanted: Array) -> Array:
    problem, count = NonNegative.allocate(1), columns.shape[1]
    problem.gram[:count, :count] = columns.T @ columns
    problem.right[:count] = columns.T @ wanted
    solve(problem, count)
    return np.array(problem.x[:count])


@pytest.mark.parametrize("count", [1, 3, 6, 7, 12, 24])
def test_as_good_as_scipys(count: int) -> None:
    rng = np.random.default_rng(count)
    for _ in range(50):
        columns, wanted = rng.normal(size=(6, count)), rng.normal(size=6)
        x, (expected, residual) = solution(columns, wanted), nnls(columns, wanted)
        assert np.all(x >= 0.0)
        found = np.linalg.norm(columns @ x - wanted)
        assert found == pytest.approx(residual, rel=1e-7, abs=1e-6)
        if count <= 6:
            np.testing.assert_allclose(x, expected, rtol=1e-6, atol=1e-7)


def test_dependent_columns() -> None:
    """Thrusters in pairs, as they are mounted: opposite, parallel, equal."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        few = rng.integers(-1, 2, size=(6, 4)).astype(float)
        columns = np.hstack([few, -few, few, 2.0 * few[:, :2], np.zeros((6, 1))])
        wanted = rng.normal(size=6)
        x, (_, residual) = solution(columns, wanted), nnls(columns, wanted)
        assert np.all(x >= 0.0)
        assert np.linalg.norm(columns @ x - wanted) == pytest.approx(residual, abs=1e-6)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_scale_of_the_demand_does_not_matter(scale: float) -> None:
    rng = np.random.default_rng(2)
    columns, wanted = rng.normal(size=(6, MOST_THRUSTERS)), rng.normal(size=6)
    np.testing.assert_allclose(
        solution(columns, scale * wanted), scale * solution(columns, wanted), rtol=1e-9
    )
    np.testing.assert_array_equal(solution(columns, 0.0 * wanted), 0.0)


def test_no_more_columns_than_rows() -> None:
    rng = np.random.default_rng(3)
    for _ in range(30):
        x = solution(rng.normal(size=(6, 24)), rng.normal(size=6))
        assert np.count_nonzero(x) <= 6
