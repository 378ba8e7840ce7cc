"""Elementary functions against long doubles and SciPy, in units in the last place."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr
from scipy.stats import norm

from space_robot_model.elementary.exponential import exp, log
from space_robot_model.elementary.normal import normal_cdf, normal_numbers, normal_quantile
from space_robot_model.elementary.series import plain_sin_cos
from space_robot_model.elementary.sine import sin_cos, sines_cosines

RNG = np.random.default_rng(5)


def ulps(found: ArrayLike, exact: NDArray[np.longdouble]) -> float:
    """Largest error in units in the last place."""
    return float(np.max(np.abs(found - exact) / np.spacing(np.abs(exact).astype(np.float64))))


@pytest.mark.parametrize(
    "angles",
    [
        *(RNG.uniform(-largest, largest, 300) for largest in (0.8, 7.0, 1e3, 1.6e6)),
        0.5 * math.pi * np.concatenate((np.arange(1, 40), RNG.integers(40, 1_000_000, 100))),
    ],
)
def test_sine_and_cosine_up_to_their_last_place(angles: NDArray[np.float64]) -> None:
    """Beside the quarter turns, too."""
    exact = angles.astype(np.longdouble)
    for found, wanted in zip(sines_cosines(angles), (np.sin(exact), np.cos(exact)), strict=True):
        assert ulps(found, wanted) < 0.8


def test_sine_and_cosine_beyond_are_those_of_an_angle_as_near_as_its_neighbours() -> None:
    x = 10.0 ** RNG.uniform(6.3, 15.0, 200)
    sine, cosine = sines_cosines(x)
    np.testing.assert_allclose(sine**2 + cosine**2, 1.0, atol=1e-15)
    assert (np.abs(sine - np.sin(x.astype(np.longdouble))) < np.spacing(x) + 1e-15).all()


def test_plain_and_compiled_sine_have_the_same_bits() -> None:
    for x in (*RNG.uniform(-4.0, 4.0, 50), *RNG.uniform(-1e7, 1e7, 50)):
        assert plain_sin_cos(float(x)) == sin_cos(x)


def test_arrays_have_the_bits_of_their_numbers() -> None:
    angles = RNG.uniform(-4.0, 4.0, (2, 3))
    sines, cosines = sines_cosines(angles)
    assert sines.shape == cosines.shape == angles.shape
    assert sin_cos(angles[1, 2]) == (sines[1, 2], cosines[1, 2])
    assert normal_quantile(0.3) == normal_quantile([0.1, 0.3])[1]


@pytest.mark.parametrize(
    ("function", "oracle", "numbers"),
    [
        (exp, np.exp, RNG.uniform(-700.0, 709.0, 500)),
        (exp, np.exp, RNG.uniform(-1.0, 1.0, 500)),
        (log, np.log, RNG.uniform(0.0, 3.0, 500)),
        (log, np.log, 10.0 ** RNG.uniform(-320.0, 300.0, 500)),
        (log, np.log, 1.0 + RNG.normal(size=500) * 1e-6),
    ],
)
def test_exponential_and_logarithm_up_to_their_last_place(
    function: Callable[[float], float], oracle: np.ufunc, numbers: NDArray[np.float64]
) -> None:
    found = [function(float(x)) for x in numbers]
    assert ulps(found, oracle(numbers.astype(np.longdouble))) < 0.9


def test_what_is_no_number_is_as_in_the_c_library() -> None:
    with np.errstate(all="ignore"):
        for x in (-math.inf, -750.0, -745.13, 0.0, 709.78, 709.79, math.inf, math.nan):
            np.testing.assert_allclose(exp(x), np.exp(x), rtol=1e-15, err_msg=str(x))
        for x in (-1.0, 0.0, 5e-324, 1.0, math.inf, math.nan):
            np.testing.assert_allclose(log(x), np.log(x), rtol=1e-15, err_msg=str(x))
    for x in (-math.inf, math.inf, math.nan):
        assert np.isnan(sin_cos(x)).all()
    found = normal_quantile([0.0, 0.5, 1.0, -0.1, 1.1, math.nan])
    np.testing.assert_array_equal(found, [-np.inf, 0.0, np.inf, np.nan, np.nan, np.nan])


def test_the_normal_distribution_is_scipys() -> None:
    shares = np.concatenate((RNG.uniform(size=2000), 10.0 ** RNG.uniform(-300, -1, 2000)))
    np.testing.assert_allclose(normal_quantile(shares), norm.ppf(shares), rtol=4e-15)
    z = np.concatenate((RNG.uniform(-37.0, 9.0, 2000), (-3.0, 0.0, 3.0)))
    np.testing.assert_allclose([normal_cdf(x) for x in z], ndtr(z), rtol=3e-13)
    assert np.isnan(normal_cdf(math.nan))
    np.testing.assert_allclose(normal_quantile([normal_cdf(-1.25)]), -1.25, rtol=1e-14)


@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_normal_numbers_are_those_of_numpys_generator(seed: int, key: int, block: int) -> None:
    bits = np.random.PCG64((seed, key, block)).random_raw(48)
    shares = ((bits >> np.uint64(12)).astype(float) + 0.5) * 2.0**-52
    draws = np.empty((8, 6))
    normal_numbers(draws, float(seed), key, block)
    np.testing.assert_array_equal(draws.ravel(), normal_quantile(shares))
