"""Splines against SciPy's."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import interpolate

from space_robot_model.elementary.spline import CubicSpline


@given(st.integers(2, 40), st.integers(1, 5), st.integers(0, 2**31 - 1))
@settings(deadline=None)
def test_clamped_splines_are_scipys(knots: int, size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.05, 1.0, knots))
    values, ends = rng.normal(size=(knots, size)), rng.normal(size=(2, size))
    ours = CubicSpline(times, values, *ends)
    theirs = interpolate.CubicSpline(times, values, bc_type=((1, ends[0]), (1, ends[1])))
    at = np.sort(rng.uniform(times[0], times[-1], 50))
    rows = ours.at(at)
    for order in range(3):
        expected = theirs(at, order)
        scale = max(1.0, float(np.max(np.abs(expected))))
        np.testing.assert_allclose(rows[:, order], expected, rtol=0.0, atol=1e-10 * scale)


def test_outside_its_times_a_spline_rests_at_the_nearer_end() -> None:
    spline = CubicSpline(np.array([1.0, 2.0]), np.array([[1.0], [3.0]]), 1.0, 1.0)
    np.testing.assert_array_equal(
        spline.at(np.array([0.0, 5.0]))[:, :, 0], [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]
    )
