"""Encoders: steps and noise of angles, rates measured or differenced, and stuck ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats
from sensor_bench import PERIOD, Bench, N, a_state

from space_robot_model.hardware.encoders import EncoderSettings
from space_robot_msgs_py.samples import RobotState
from space_robot_sim.sensors.encoders import Encoders

Array = NDArray[np.float64]


def moving(tick: int, period: float = PERIOD) -> RobotState:
    """Joints that leave rest at tick 0, each at its own rate."""
    state = RobotState.allocate(N)
    state.tick = tick
    state.joint_velocities[:] = 0.1 + 0.01 * np.arange(N)
    state.joint_positions[:] = 1.0 + state.joint_velocities * tick * period
    return state


@given(st.integers(8, 27))
def test_an_angle_is_a_whole_number_of_steps_of_a_turn(bits: int) -> None:
    state, step = a_state(), 2.0 * np.pi / 2**bits
    told = Bench(encoders={"bits": bits}).measure(state).joint_positions
    np.testing.assert_allclose(told / step, np.round(told / step), atol=1e-6)
    assert np.abs(told - state.joint_positions).max() <= 0.5 * step * (1.0 + 1e-6)


@pytest.mark.parametrize("bits", [0, 12])
def test_the_step_of_a_joint_that_slides_is_a_share_of_a_metre(bits: int) -> None:
    """Beside joints that turn, in the step and in what is told at rest."""
    slides, settings = np.arange(N) % 3 == 1, EncoderSettings(bits=bits)
    rest = a_state().block[0]
    encoders = Encoders.build(N, settings, PERIOD, rest, slides)
    step = np.where(slides, 1.0, 2.0 * np.pi) / 2**bits if bits else np.zeros(N)
    np.testing.assert_array_equal(encoders.step, step)
    told = encoders.history[0]
    if bits:
        np.testing.assert_allclose(told / step, np.round(told / step), atol=1e-9)
    assert (np.abs(told - rest.joint_positions) <= 0.5 * step * (1.0 + 1e-9)).all()


def test_the_error_of_quantisation_is_uniform() -> None:
    """Kolmogorov and Smirnov's test over angles that fall anywhere."""
    bench, rng, errors = Bench(encoders={"bits": 12}), np.random.default_rng(0), []
    state, step = a_state(), 2.0 * np.pi / 2**12
    for state.tick in range(1000):
        state.joint_positions[:] = rng.uniform(-10.0, 10.0, N)
        errors.append(bench.measure(state).joint_positions - state.joint_positions)
    scaled = np.ravel(errors) / step + 0.5
    assert stats.kstest(scaled, "uniform").pvalue > 1e-3
    assert np.std(errors) == pytest.approx(step / np.sqrt(12.0), rel=0.03)


def test_noise_of_angles_and_of_measured_rates() -> None:
    state = a_state()
    bench = Bench(encoders={"noise": 1e-3, "velocity_noise": 2e-2})
    angles = bench.watch(state, 4000, "joint_positions") - state.joint_positions
    assert angles.std(axis=0) == pytest.approx(1e-3, rel=0.06)
    bench = Bench(encoders={"noise": 1e-3, "velocity_noise": 2e-2})
    rates = bench.watch(state, 4000, "joint_velocities") - state.joint_velocities
    assert rates.std(axis=0) == pytest.approx(2e-2, rel=0.06)
    assert np.abs(np.mean(angles * rates) / 2e-5) < 5.0 / np.sqrt(angles.size)


@pytest.mark.parametrize(("lag", "period"), [(1, 5e-4), (10, 3e-3), (256, 5e-4)])
def test_differenced_rates(lag: int, period: float) -> None:
    """The mean rate over the time; at rest before tick 0."""
    bench = Bench(truth=moving(0), period=period, encoders={"difference_ticks": lag})
    for tick in range(lag + 300):
        state = moving(tick, period)
        told = bench.measure(state).joint_velocities
        share = min(1.0, tick / lag)
        np.testing.assert_allclose(told, share * state.joint_velocities, atol=1e-9)


@pytest.mark.parametrize(("lag", "own"), [(1, 0.0), (20, 3e-3)])
def test_noise_of_differenced_rates(lag: int, own: float) -> None:
    """2^1/2 sigma / (N T); samples N ticks apart have half of it, negative, in common.

    The noise of rates comes on top.
    """
    state, sigma = a_state(), 1e-5
    settings = {"noise": sigma, "difference_ticks": lag, "velocity_noise": own}
    rates = Bench(encoders=settings).watch(state, 4000, "joint_velocities")[lag:]
    variance = 2.0 * (sigma / (lag * PERIOD)) ** 2
    assert np.mean(rates**2) == pytest.approx(variance + own**2, rel=0.07)
    assert np.mean(rates[lag:] * rates[:-lag]) / variance == pytest.approx(-0.5, abs=0.06)


def test_rates_have_steps_of_their_own() -> None:
    told = Bench(encoders={"velocity_step": 0.25}).measure(a_state()).joint_velocities
    np.testing.assert_array_equal(told, 0.25 * np.floor(a_state().joint_velocities / 0.25 + 0.5))


@pytest.mark.parametrize("lag", [0, 4])
def test_a_stuck_encoder_stands_and_comes_back(lag: int) -> None:
    """Without noise too, at no rate; the others go on."""
    settings = {"noise": 1e-3, "velocity_noise": 1e-3, "difference_ticks": lag}
    bench = Bench("encoder_stuck@0.005-0.01:2", truth=moving(0), encoders=settings)
    rows = []
    for tick in range(30):
        told = bench.measure(moving(tick))
        rows.append([told.joint_positions[:3].copy(), told.joint_velocities[:3].copy()])
    angles, rates = np.array(rows).transpose(1, 0, 2)
    stands = np.diff(angles[:, 1]) == 0.0
    np.testing.assert_array_equal(np.flatnonzero(stands) + 1, range(10, 20))
    np.testing.assert_array_equal(np.flatnonzero(rates[:, 1] == 0.0), range(10, 20))
    assert (np.diff(angles[:, [0, 2]], axis=0) != 0.0).all()
    assert abs(angles[20, 1] - moving(20).joint_positions[1]) < 5e-3


def test_an_encoder_that_is_stuck_from_the_start_tells_where_the_joint_was() -> None:
    bench = Bench("encoder_stuck@0:joints", truth=moving(0), encoders={"noise": 0.1})
    for tick in range(20):
        told = bench.measure(moving(tick))
        np.testing.assert_array_equal(told.joint_positions, moving(0).joint_positions)
        assert not told.joint_velocities.any()
