"""The low-pass of rate and torque."""

from __future__ import annotations

import numpy as np
import pytest

from space_robot_control.navigation.low_pass import (
    LowPass,
    begin_low_pass,
    low_pass_weight,
    pass_low,
)
from space_robot_msgs_py.compiled.records import assign

PERIOD = 5e-4


def low_pass(corner: float) -> LowPass:
    found = LowPass.allocate(1)
    assign(found, weight=low_pass_weight(corner, PERIOD))
    return found


@pytest.mark.parametrize("corner", [5.0, 20.0])
def test_at_the_corner_half_is_left(corner: float) -> None:
    """Two stages of -3 dB each."""
    found, zero, largest = low_pass(corner), np.zeros(3), 0.0
    begin_low_pass(found, zero, zero)
    for tick in range(round(3.0 / corner / PERIOD)):
        rate = np.full(3, np.sin(2.0 * np.pi * corner * tick * PERIOD))
        pass_low(found, rate, zero)
        if tick > 2.0 / corner / PERIOD:
            largest = max(largest, found.rate[0])
    assert largest == pytest.approx(0.5, rel=0.03)


def test_torque_and_differenced_rate_stay_a_pair() -> None:
    rng = np.random.default_rng(1)
    found, inertia, rate = low_pass(50.0), np.array([2.0, 30.0, 700.0]), rng.normal(size=3)
    begin_low_pass(found, rate, np.zeros(3))
    for _ in range(200):
        torque = rng.normal(size=9)
        rate = rate + PERIOD * torque[:3] / inertia
        before = found.rate.copy()
        pass_low(found, rate, torque)
        np.testing.assert_allclose(
            inertia * (found.rate - before) / PERIOD, found.torque, rtol=1e-7, atol=1e-7
        )


def test_without_a_corner_there_is_none() -> None:
    found, rng = low_pass(0.0), np.random.default_rng(2)
    for _ in range(3):
        rate, torque = rng.normal(size=(2, 9))
        pass_low(found, rate, torque)
        np.testing.assert_array_equal(found.rate, rate[:3])
        np.testing.assert_array_equal(found.torque, torque[:3])
