"""The joints' filter against Riccati's equation and the exact motion; the low-pass of the base."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are

from space_robot_control.navigation.rate_filters import (
    JointFilter,
    LowPass,
    begin_joints,
    begin_low_pass,
    filter_joints,
    jerk_density,
    low_pass_weight,
    pass_low,
    tune,
)
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.records import assign

PERIOD = 5e-4


def model(period: float, density: float) -> tuple[Array, Array]:
    """Transition and noise of a chain of three integrators driven by white jerk."""
    t = period
    transition = np.array([[1.0, t, 0.5 * t * t], [0.0, 1.0, t], [0.0, 0.0, 1.0]])
    noise = density * np.array(
        [
            [t**5 / 20.0, t**4 / 8.0, t**3 / 6.0],
            [t**4 / 8.0, t**3 / 3.0, t**2 / 2.0],
            [t**3 / 6.0, t**2 / 2.0, t],
        ]
    )
    return transition, noise


def tuned(n: int, corner: float, angle: float, rate: float, period: float = PERIOD) -> JointFilter:
    filter = JointFilter.allocate(n)
    tune(filter, corner, angle, rate, period)
    return filter


@pytest.mark.parametrize("rate", [0.0, 1e-5, 1e-3])
@pytest.mark.parametrize(("corner", "period"), [(3.0, 5e-4), (100.0, 5e-4), (100.0, 5e-3)])
def test_gains_are_those_of_riccatis_equation(corner: float, period: float, rate: float) -> None:
    angle, units = 1e-6, np.diag([1e6, 1e6 * period, 1e6 * period**2])
    density = jerk_density(2.0 * np.pi * corner, angle, rate, period)
    transition, noise = model(period, density)
    observed = np.eye(3)[: 2 if rate else 1]
    measured = np.diag([angle**2, rate**2][: len(observed)])
    scaled = units @ transition @ np.linalg.inv(units)
    rows = observed @ np.linalg.inv(units)
    scale = np.diag(1.0 / np.sqrt(np.diag(measured)))
    p = solve_discrete_are(scaled.T, (scale @ rows).T, units @ noise @ units, np.eye(len(observed)))
    p = np.linalg.inv(units) @ p @ np.linalg.inv(units)
    gain = p @ observed.T @ np.linalg.inv(observed @ p @ observed.T + measured)
    filter = tuned(1, corner, angle, rate, period)
    # taken one after the other: the second sees what the first left
    both = np.column_stack([filter.angle_gain, filter.rate_gain])[:, : len(observed)]
    if rate:
        both[:, 0] -= both[:, 1] * filter.angle_gain[1]
    np.testing.assert_allclose(both, gain, rtol=1e-6)


@pytest.mark.parametrize("corner", [2.0, 20.0])
def test_with_the_angle_alone_the_poles_are_butterworths(corner: float) -> None:
    """Of third order, at the bandwidth, as long as that is slow beside the ticks."""
    filter = tuned(1, corner, 1e-6, 0.0)
    transition, _ = model(PERIOD, 0.0)
    closed = (np.eye(3) - np.outer(filter.angle_gain, [1.0, 0.0, 0.0])) @ transition
    poles = np.log(np.linalg.eigvals(closed)) / PERIOD / (2.0 * np.pi * corner)
    expected = np.array([-1.0, -0.5 + 0.5j * 3**0.5, -0.5 - 0.5j * 3**0.5])
    for pole in expected:
        assert np.abs(poles - pole).min() < 0.1 * corner * PERIOD * 20


@given(st.floats(-3.0, 3.0), st.floats(-1.0, 1.0), st.floats(-5.0, 5.0))
@settings(max_examples=20)
def test_constant_acceleration_is_followed_without_lag(a: float, b: float, c: float) -> None:
    filter = tuned(1, 50.0, 1e-7, 0.0)
    none = np.zeros(1)
    begin_joints(filter, np.array([a]), np.array([b]), none)
    for tick in range(1, 400):
        t = tick * PERIOD
        filter_joints(filter, np.array([a + b * t + 0.5 * c * t * t]), none, none, PERIOD)
    np.testing.assert_allclose(filter.angle[0], a + b * t + 0.5 * c * t * t, atol=1e-10)
    np.testing.assert_allclose(filter.rate[0], b + c * t, atol=1e-8)
    np.testing.assert_allclose(filter.acceleration[0], c, atol=1e-5)


@given(st.integers(0, 2**32 - 1), st.sampled_from([2.0, 40.0, 300.0]), st.sampled_from([0.0, 1e-4]))
@settings(max_examples=8)
def test_torque_and_differenced_rate_stay_a_pair(
    seed: int, corner: float, rate_noise: float
) -> None:
    """On a constant inertia, under any torque held over each interval, also over lost ticks."""
    rng = np.random.default_rng(seed)
    inertia, n = rng.uniform(0.5, 50.0, 4), 4
    filter = tuned(n, corner, 1e-6, rate_noise)
    angle, rate = rng.normal(size=(2, n))
    begin_joints(filter, angle, rate, np.zeros(n))
    for _ in range(200):
        torque, duration = rng.normal(size=n), PERIOD * rng.choice([1, 1, 1, 2, 7])
        acceleration = torque / inertia
        angle = angle + duration * (rate + 0.5 * duration * acceleration)
        rate = rate + duration * acceleration
        before = filter.rate.copy()
        filter_joints(filter, angle, rate, torque, duration)
        np.testing.assert_allclose(
            inertia * (filter.rate - before) / duration, filter.torque, rtol=1e-6, atol=1e-6
        )


def test_without_a_bandwidth_what_is_measured_is_handed_on() -> None:
    filter = tuned(2, 0.0, 1e-6, 0.0)
    rng = np.random.default_rng(2)
    for _ in range(3):
        angle, rate, torque = rng.normal(size=(3, 2))
        filter_joints(filter, angle, rate, torque, PERIOD)
        np.testing.assert_array_equal(filter.angle, angle)
        np.testing.assert_array_equal(filter.rate, rate)
        np.testing.assert_array_equal(filter.torque, torque)


# The low-pass


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


def test_torque_and_differenced_rate_of_the_base_stay_a_pair() -> None:
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
