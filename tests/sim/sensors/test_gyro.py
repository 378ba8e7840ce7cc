"""The gyro: its Allan variance against both random walks, bias, scale and steps."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from sensor_bench import Bench, N, a_state

from space_robot_msgs_py.samples import RobotState

Array = NDArray[np.float64]

SEEDS = range(4)


@cache
def record(ticks: int, period: float, seed: int, **settings: float) -> Array:
    """Measured rates (ticks, 3) of a base at rest."""
    bench = Bench(seed=seed, period=period, gyro=settings)
    return bench.watch(RobotState.allocate(N), ticks, "omega_base")


def allan_variance(rates: Array, count: int) -> Array:
    """Of means over ``count`` samples, overlapping: half the mean square of their differences."""
    sums = np.cumsum(np.vstack([np.zeros(rates.shape[1]), rates]), axis=0)
    means = (sums[count:] - sums[:-count]) / count
    result: Array = 0.5 * np.mean((means[count:] - means[:-count]) ** 2, axis=0)
    return result


@pytest.mark.parametrize("count", [1, 10, 100])
def test_angle_random_walk(count: int) -> None:
    """Allan variance sigma_v^2 / tau (IEEE 952), whatever the period: a slope of -1."""
    for period in (5e-4, 0.01):
        rates = np.hstack([record(6000, period, seed, angle_random_walk=1e-4) for seed in SEEDS])
        found = allan_variance(rates, count).mean()
        assert found == pytest.approx(1e-8 / (count * period), rel=0.1)


@pytest.mark.parametrize("count", [30, 100])
def test_rate_random_walk(count: int) -> None:
    """Allan variance sigma_u^2 tau / 3 (IEEE 952): a slope of +1."""
    rates = np.hstack([record(6000, 0.1, seed, rate_random_walk=1e-5) for seed in SEEDS])
    found = allan_variance(rates, count).mean()
    assert found == pytest.approx(1e-10 * count * 0.1 / 3.0, rel=0.15)


def test_both_walks_cross_where_they_should() -> None:
    """At tau = 3^1/2 sigma_v / sigma_u both have the same share."""
    sigma_v, sigma_u, period = 1e-4, 1e-4, 0.02
    count = round(np.sqrt(3.0) * sigma_v / sigma_u / period)
    both = {"angle_random_walk": sigma_v, "rate_random_walk": sigma_u}
    rates = np.hstack([record(6000, period, seed, **both) for seed in SEEDS])
    tau = count * period
    expected = sigma_v**2 / tau + sigma_u**2 * tau / 3.0
    assert allan_variance(rates, count).mean() == pytest.approx(expected, rel=0.1)


def test_the_angle_and_the_bias_walk_as_farrenkopf_says() -> None:
    """Over 1200 gyros at rest, 40 samples on: variances of angle, bias and their product.

    P = [[s_v^2 t + s_u^2 t^3 / 3, s_u^2 t^2 / 2], [s_u^2 t^2 / 2, s_u^2 t]], for any period.
    """
    sigma_v, sigma_u, period, steps = 1e-4, 1e-3, 0.05, 40
    walks = []
    for seed in range(400):
        bench = Bench(
            seed=seed, period=period,
            gyro={"angle_random_walk": sigma_v, "rate_random_walk": sigma_u},
        )  # fmt: skip
        rates = bench.watch(RobotState.allocate(N), steps + 1, "omega_base")
        walks.append([rates[1:].sum(axis=0) * period, bench.block[0].gyro.bias])
    angle, bias = np.array(walks).transpose(1, 0, 2).reshape(2, -1)
    t = steps * period
    found = [np.mean(angle**2), np.mean(angle * bias), np.mean(bias**2)]
    expected = [
        sigma_v**2 * t + sigma_u**2 * t**3 / 3.0, sigma_u**2 * t**2 / 2.0, sigma_u**2 * t,
    ]  # fmt: skip
    np.testing.assert_allclose(found, expected, rtol=5.0 * np.sqrt(2.0 / angle.size))


def test_white_noise_of_a_sample_is_the_same_at_every_period() -> None:
    for period in (5e-4, 0.01):
        rates = record(4000, period, 0, noise=1e-3)
        assert rates.std() == pytest.approx(1e-3, rel=0.05)


def test_scale_bias_and_steps() -> None:
    """In that order: step floor(((1 + e) omega + b) / step + 1/2)."""
    state, bias, error = a_state(), np.array([0.1, -0.2, 0.3]), np.array([0.01, 0.02, -0.5])
    settings = {"initial_bias": bias.tolist(), "scale_factor_error": error.tolist(), "step": 0.01}
    told = Bench(gyro=settings).measure(state).omega_base
    expected = 0.01 * np.floor(((1.0 + error) * state.omega_base + bias) / 0.01 + 0.5)
    np.testing.assert_allclose(told, expected, atol=1e-15)


def test_a_bias_comes_and_goes() -> None:
    """On the axes named, beside the one there is, and without a trace."""
    bench = Bench(
        "gyro_bias@0.005-0.01:base_y=0.25", "gyro_bias@0.0075-0.0125:base=-0.5",
        gyro={"initial_bias": [1.0, 0.0, 0.0]},
    )  # fmt: skip
    state = RobotState.allocate(N)
    for state.tick in range(30):
        late = -0.5 * (15 <= state.tick < 25)
        own = 0.25 * (10 <= state.tick < 20)
        told = bench.measure(state).omega_base
        np.testing.assert_array_equal(told, [1.0 + late, own + late, late])
