"""N_hat of (35), (36): exact where force and acceleration belong together."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from random_robots import JOINTS

from space_robot_control.controller.time_delay_estimation import (
    LONGEST_GAP,
    TimeDelayPair,
    observe,
    time_delay_estimate,
)
from space_robot_control.navigation.low_pass import low_pass_weight
from space_robot_msgs_py.compiled.records import assign

Array = NDArray[np.float64]

PERIOD = 5e-4


class Estimator:
    """The kernels on a pair of their own; ``desired`` is the desired acceleration of all axes."""

    def __init__(self, axes: int, desired: float = 0.0, corner_hz: float = 0.0) -> None:
        self.pair = TimeDelayPair.allocate(axes - 3)
        assign(self.pair, smoothing=low_pass_weight(corner_hz, PERIOD))
        self.desired = np.full(axes, desired)

    def observe(self, tick: int, force: Array, rate: Array) -> None:
        observe(self.pair, tick, force, rate, self.desired, PERIOD)

    def estimate(self, h_bar: Array) -> Array:
        n_hat = np.full_like(h_bar, np.nan)
        time_delay_estimate(self.pair, h_bar, n_hat)
        return n_hat


def vectors(size: int, low: float = -100.0, high: float = 100.0) -> st.SearchStrategy[Array]:
    return arrays(np.float64, size, elements=st.floats(low, high, width=32))


@st.composite
def pairs(draw: st.DrawFn) -> tuple[Array, ...]:
    """h_bar, N, rate at a tick, and the acceleration until the next."""
    axes = 3 + draw(st.sampled_from(JOINTS))
    h_bar = draw(vectors(axes, 0.125, 100.0))
    return h_bar, draw(vectors(axes)), draw(vectors(axes, -5.0, 5.0)), draw(vectors(axes))


@given(pairs(), st.integers(0, 10**7))
def test_estimate_recovers_n_of_a_consistent_pair(pair: tuple[Array, ...], tick: int) -> None:
    """With F = h_bar rhodd + N over the interval, N_hat = N to rounding."""
    h_bar, n, rate, acceleration = pair
    estimator = Estimator(len(n))
    estimator.observe(tick, np.zeros(len(n)), rate)
    estimator.observe(tick + 1, h_bar * acceleration + n, rate + acceleration * PERIOD)
    np.testing.assert_allclose(estimator.pair.acceleration, acceleration, atol=1e-9)
    np.testing.assert_allclose(estimator.estimate(h_bar), n, atol=1e-9 * h_bar.max() + 1e-12)


@given(pairs())
def test_estimate_follows_the_last_pair_only(pair: tuple[Array, ...]) -> None:
    """A long past makes no difference to the bits."""
    h_bar, n, rate, acceleration = pair
    long, short = (Estimator(len(n)) for _ in range(2))
    for tick in range(5):
        long.observe(tick, n * tick, acceleration * tick)
    for estimator in (long, short):
        estimator.observe(5, n, rate)
        estimator.observe(6, n + 1.0, acceleration)
    np.testing.assert_array_equal(long.estimate(h_bar), short.estimate(h_bar))


def observed(*ticks: tuple[int, float, float], **options: float) -> Estimator:
    """An estimator of two axes that saw (tick, force, rate)."""
    estimator = Estimator(2, **options)
    for tick, force, rate in ticks:
        estimator.observe(tick, np.full(2, force), np.full(2, rate))
    return estimator


@pytest.mark.parametrize("before", [(), ((0, 9.0, 7.0),)])
def test_without_a_pair_the_motion_is_taken_for_the_desired_one(
    before: tuple[tuple[int, float, float], ...],
) -> None:
    """At the first tick and after a long gap: the best guess that needs no past."""
    estimator = observed(*before, (LONGEST_GAP + 1, 50.0, 3.0), desired=4.0)
    np.testing.assert_allclose(estimator.estimate(np.full(2, 2.0)), 50.0 - 2.0 * 4.0)


@given(st.integers(2, LONGEST_GAP))
def test_over_a_short_gap_the_mean_acceleration_is_the_pairs(gap: int) -> None:
    """The plant held its command, so the force it reports acted all that time."""
    estimator = observed((5, 0.0, 0.0), (5 + gap, 7.0, 3.0 * gap * PERIOD))
    np.testing.assert_allclose(estimator.estimate(np.full(2, 2.0)), 7.0 - 2.0 * 3.0, rtol=1e-9)


def test_pairs_are_formed_anew_after_a_gap() -> None:
    """From the rate at the tick that ended the gap."""
    estimator = observed((0, 0.0, 0.0), (1, 5.0, 0.001), (97, 99.0, 0.5), (98, 6.0, 0.5005))
    np.testing.assert_allclose(estimator.pair.acceleration, 1.0, rtol=1e-9)
    np.testing.assert_allclose(estimator.estimate(np.full(2, 2.0)), 4.0, rtol=1e-9)


@given(st.floats(1.0, 900.0), st.floats(-50.0, 50.0))
def test_low_pass_keeps_force_and_acceleration_a_pair(corner_hz: float, n: float) -> None:
    """Whatever both do, N_hat of a constant N is N: none of it is filtered away."""
    rng = np.random.default_rng(1)
    filtered = Estimator(2, corner_hz=corner_hz)
    rate = 0.0
    filtered.observe(0, np.full(2, n), np.zeros(2))  # N alone at rest
    for tick in range(1, 50):
        acceleration = rng.normal()
        rate += acceleration * PERIOD
        filtered.observe(tick, np.full(2, 2.0 * acceleration + n), np.full(2, rate))
    np.testing.assert_allclose(filtered.estimate(np.full(2, 2.0)), n, atol=1e-8)


def test_low_pass_reaches_63_per_cent_in_its_time_constant() -> None:
    corner_hz = 20.0
    time_constant = round(1.0 / (2.0 * np.pi * corner_hz) / PERIOD)
    estimator = observed((0, 0.0, 0.0), corner_hz=corner_hz)
    for tick in range(1, time_constant + 1):
        estimator.observe(tick, np.ones(2), np.zeros(2))
    np.testing.assert_allclose(estimator.pair.applied_force, 1.0 - np.exp(-1.0), atol=0.01)


def test_estimator_keeps_copies_of_what_it_is_shown() -> None:
    """The nodes overwrite their arrays in place."""
    force, rate = np.array([1.0, 2.0]), np.array([0.1, 0.2])
    estimator = Estimator(2)
    estimator.observe(0, force, rate)
    force += 3.0
    rate += 0.001
    estimator.observe(1, force, rate)
    force[:] = rate[:] = np.nan
    # forces 4 and 5, acceleration 0.001 / PERIOD = 2
    np.testing.assert_allclose(estimator.estimate(np.array([1.0, 3.0])), [2.0, -1.0], rtol=1e-9)
