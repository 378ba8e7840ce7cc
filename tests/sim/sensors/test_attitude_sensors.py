"""Gyro and star tracker: walks, bias, scale and steps; noise by axis, rate, delay, blindness."""

from __future__ import annotations

import numpy as np
import pytest
from benches import PERIOD, N, a_state
from benches import SensorBench as Bench
from hypothesis import given
from hypothesis import strategies as st
from oracles import rotation_of
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotState


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


def turning(tick: int) -> RobotState:
    """A base that turns about z, by 1e-3 rad a tick; at rest before tick 0."""
    state = RobotState.allocate(N)
    state.tick = tick
    state.quaternion[:] = [np.cos(5e-4 * tick), 0.0, 0.0, np.sin(5e-4 * tick)]
    return state


def ticks_shown(bench: Bench, ticks: int) -> list[int]:
    """The tick whose attitude is told at each tick, of a tracker without noise."""
    told = [bench.measure(turning(tick)).quaternion.copy() for tick in range(ticks)]
    return [round(2.0 * np.arctan2(q[3], q[0]) / 1e-3) for q in told]


@given(st.integers(1, 40), st.integers(0, 80), st.booleans())
def test_it_is_sampled_held_and_late_to_the_tick(
    interval: int, delay: int, has_turned: bool
) -> None:
    """A base that turned before tick 0 is shown as it was then, with no jump of what is told."""
    settings = {"rate": 1.0 / (interval * PERIOD), "delay": delay * PERIOD}
    truth, before = turning(0), -delay if has_turned else 0
    truth.omega_base[2] = has_turned * 1e-3 / PERIOD
    if delay // interval > 63:
        with pytest.raises(InputError, match=r"star_tracker\.delay holds .* at most 63"):
            Bench(star_tracker=settings)
        return
    shown = ticks_shown(Bench(truth=truth, star_tracker=settings), 200)
    sampled = [(tick - delay) // interval * interval for tick in range(200)]
    assert shown == [exposed if exposed >= 0 else before for exposed in sampled]


@pytest.mark.parametrize("period", [PERIOD, 4e-3])
def test_an_interval_is_a_whole_number_of_ticks(period: float) -> None:
    """The nearest, at any period."""
    settings = {"rate": 1.0 / (6.67 * period), "delay": 2.4 * period}
    tracker = Bench(period=period, star_tracker=settings).block[0].star_tracker
    assert (tracker.interval, tracker.delay) == (7, 2)


@pytest.mark.parametrize("boresight", [[0.0, 0.0, 1.0], [1.0, 2.0, -2.0]])
def test_noise_is_that_of_each_axis(boresight: list[float]) -> None:
    """Covariance on base axes: across^2 (E - b b^T) + about^2 b b^T."""
    across, about, count = 1e-4, 8e-4, 6000
    state = a_state()
    bench = Bench(
        star_tracker={"noise_across": across, "noise_about": about, "boresight": boresight}
    )
    seen = bench.watch(state, count, "quaternion")
    errors = (rotation_of(state.quaternion).inv() * rotations(seen)).as_rotvec()
    b = np.array(boresight) / np.linalg.norm(boresight)
    expected = across**2 * (np.eye(3) - np.outer(b, b)) + about**2 * np.outer(b, b)
    found = errors.T @ errors / count
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.abs((found - expected) / scale).max() < 5.0 * np.sqrt(2.0 / count)
    assert np.abs(errors.mean(axis=0) / np.sqrt(np.diag(expected))).max() < 5.0 / np.sqrt(count)


def rotations(quaternions: Array) -> Rotation:
    return Rotation.from_quat(quaternions[:, [1, 2, 3, 0]])


def test_a_blind_tracker_tells_what_it_told_last() -> None:
    """What was exposed before is still released; exposures within the time are lost."""
    settings = {"rate": 1.0 / (10 * PERIOD), "delay": 5 * PERIOD}
    bench = Bench("tracker_blind@0.0205-0.0405", truth=turning(0), star_tracker=settings)
    shown = ticks_shown(bench, 100)  # blind in ticks 41 to 80
    assert shown[41:45] == [30] * 4
    assert shown[45:95] == [40] * 50
    assert shown[95:] == [90] * 5
