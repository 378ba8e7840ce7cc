"""Noise and lag as the laws see them, against formulas for white noise and low-passes."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.tuning.noise import Noise, listen

PERIOD = 5e-4


@functools.cache
def heard(sensors: str, navigation: Any = "direct", corner: float = 100.0) -> Noise:
    own = {"navigation_filter.rate_filter_hz": corner, "navigation_filter.joint_bandwidth_hz": 0.0}
    plan = FlightPlan(
        sensors=sensors, navigation=navigation, case="3", parameters={"controller": own}
    )
    flight = Flight(resolve(plan))
    return listen(
        flight.robot,
        flight.plant_settings,
        flight.controller_settings.filter_settings,
        flight.mission_settings,
        flight.period,
    )


def test_ideal_sensors_have_none() -> None:
    found = heard("ideal")
    assert not found.rates.any()
    assert found.lag == 0.0


def test_white_noise_has_the_size_it_is_given() -> None:
    found = heard("white_l1")  # 1e-6 and 1e-5 rad/s; J0 = E / 2
    np.testing.assert_allclose(found.rates.std(axis=0), [5e-7] * 3 + [1e-5] * 6, rtol=0.05)
    np.testing.assert_allclose(found.errors.std(axis=0), [5e-6] * 3 + [1e-5] * 6, rtol=0.05)
    assert np.abs(np.corrcoef(found.rates.T) - np.eye(9)).max() < 0.05


@pytest.mark.parametrize("weight", [1.0, 0.3, 0.02])
def test_acceleration_is_that_of_a_low_pass_of_differences(weight: float) -> None:
    """Variance of ``w (v_k - v_k-1) / (1 - (1 - w) z^-1)``: ``2 w^2 / (2 - w)`` of that of v."""
    expected = math.sqrt(2.0 / (2.0 - weight)) * weight / PERIOD
    found = heard("white_l1").acceleration(weight)
    np.testing.assert_allclose(found, np.array([5e-7] * 3 + [1e-5] * 6) * expected, rtol=0.06)


@pytest.mark.parametrize("corner", [20.0, 100.0])
def test_lag_is_that_of_both_low_passes(corner: float) -> None:
    weight = 1.0 - math.exp(-2.0 * math.pi * corner * PERIOD)
    expected = 2.0 * PERIOD * (1.0 - weight) / weight
    assert heard("ideal", "filtered", corner).lag == pytest.approx(expected, rel=1e-6)


def test_it_is_the_same_twice() -> None:
    first, second = heard("white_l2"), heard.__wrapped__("white_l2")
    np.testing.assert_array_equal(first.rates, second.rates)
