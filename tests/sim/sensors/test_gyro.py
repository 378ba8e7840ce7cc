"""The gyro: both random walks against their exact discretisation, bias, scale and steps."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from sensor_bench import Bench, N, a_state

from space_robot_msgs_py.samples import RobotState

Array = NDArray[np.float64]


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


def test_the_walks_have_the_slopes_of_ieee_952() -> None:
    """Allan variance sigma_v^2 / tau + sigma_u^2 tau / 3, around where both have the same share."""
    sigma_v, sigma_u, period = 1e-4, 1e-4, 0.02
    walks = {"angle_random_walk": sigma_v, "rate_random_walk": sigma_u}
    rates = np.hstack([record(4000, period, seed, **walks) for seed in range(6)])
    for tau in np.array([0.1, 1.0]) * np.sqrt(3.0) * sigma_v / sigma_u:
        expected = sigma_v**2 / tau + sigma_u**2 * tau / 3.0
        found = allan_variance(rates, round(tau / period)).mean()
        assert found == pytest.approx(expected, rel=0.12)


def exact_covariance(sigma_v: float, sigma_u: float, period: float) -> Array:
    """(2, 2) of angle and bias after a period, by Van Loan's exponential (1978)."""
    drift = np.array([[0.0, 1.0], [0.0, 0.0]])
    density = np.diag([sigma_v**2, sigma_u**2])
    both = expm(np.block([[-drift, density], [np.zeros((2, 2)), drift.T]]) * period)
    covariance: Array = both[2:, 2:].T @ both[:2, 2:]
    return covariance


@pytest.mark.parametrize("period", [5e-4, 0.05, 3.0])
@pytest.mark.parametrize("share", [0.3, 4.0])
def test_each_sample_is_the_exact_discretisation_of_both_walks(period: float, share: float) -> None:
    """What angle and bias gain in each period: covariance, and nothing from tick to tick.

    ``share``: of the angle's variance, the bias's walk to the white noise.
    """
    sigma_v, ticks = 1e-4, 3000
    sigma_u = np.sqrt(3.0 * share) * sigma_v / period
    bench = Bench(period=period, gyro={"angle_random_walk": sigma_v, "rate_random_walk": sigma_u})
    state, angles, biases = RobotState.allocate(N), np.empty((ticks, 3)), np.empty((ticks, 3))
    for state.tick in range(ticks):
        angles[state.tick] = period * bench.measure(state).omega_base
        biases[state.tick] = bench.block[0].gyro.bias
    assert not biases[0].any(), "before tick 0 nothing walks"
    gained = np.stack([angles[1:] - period * biases[:-1], np.diff(biases, axis=0)])
    scale = np.sqrt(np.diag(exact_covariance(sigma_v, sigma_u, period)))
    gained /= scale[:, np.newaxis, np.newaxis]
    flat, bound = gained.reshape(2, -1), 5.0 * np.sqrt(2.0 / (3 * ticks))
    expected = exact_covariance(sigma_v, sigma_u, period) / np.outer(scale, scale)
    np.testing.assert_allclose(flat @ flat.T / flat.shape[1], expected, rtol=0.0, atol=bound)
    late = np.einsum("itk,jtk->ij", gained[:, 1:], gained[:, :-1]) / flat.shape[1]
    assert np.abs(late).max() < bound


def test_at_tick_0_there_is_the_initial_bias_and_white_noise() -> None:
    """The variance of samples, over 1000 seeds: sigma_v^2 / h + sigma_u^2 h / 12 + sigma^2."""
    sigma_v, sigma_u, period, bias = 1e-4, 1e-2, 0.05, np.array([1.0, -2.0, 3.0])
    sigma = 5e-4
    settings = {
        "angle_random_walk": sigma_v,
        "rate_random_walk": sigma_u,
        "initial_bias": bias.tolist(),
        "noise": sigma,
    }
    bench, state = Bench(period=period, gyro=settings), RobotState.allocate(N)
    rates = np.empty((1000, 3))
    for seed in range(len(rates)):
        bench.block["seed"], bench.block["drawn"] = seed, -1.0
        rates[seed] = bench.measure(state).omega_base - bias
    expected = sigma_v**2 / period + sigma_u**2 * period / 12.0 + sigma**2
    assert np.mean(rates**2) == pytest.approx(expected, rel=5.0 * np.sqrt(2.0 / rates.size))


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
        "gyro_bias@0.005-0.01:base_y=0.25",
        "gyro_bias@0.0075-0.0125:base=-0.5",
        gyro={"initial_bias": [1.0, 0.0, 0.0]},
    )
    state = RobotState.allocate(N)
    for state.tick in range(30):
        late = -0.5 * (15 <= state.tick < 25)
        own = 0.25 * (10 <= state.tick < 20)
        told = bench.measure(state).omega_base
        np.testing.assert_array_equal(told, [1.0 + late, own + late, late])
