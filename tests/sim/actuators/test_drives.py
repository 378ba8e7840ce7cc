"""Drives and the torque that they report: each effect against its definition, lags exactly."""

from __future__ import annotations

import numpy as np
import pytest
from benches import PERIOD, N
from benches import ActuatorBench as Bench
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from strategies import SEEDS

from space_robot_model.elementary.matrices import Array
from space_robot_sim.actuators.drive import Drive


def torques(seed: int, ticks: int = 50, size: float = 10.0) -> Array:
    return size * np.random.default_rng(seed).normal(size=(ticks, N + 3))


def per_axis(seed: int, low: float, high: float) -> list[float]:
    values: list[float] = np.random.default_rng(seed).uniform(low, high, N + 3).tolist()
    return values


@given(SEEDS)
def test_sound_drives_give_what_is_asked_to_the_bit(seed: int) -> None:
    """The sign of a zero too: a flight is the same with this code as without."""
    drives = Bench()
    for torque in [*torques(seed), -np.zeros(N + 3), np.zeros(N + 3)]:
        for out in drives.act(torque):
            assert out.tobytes() == torque.tobytes()


@given(SEEDS, st.floats(1e-5, 1.0), st.integers(1, 9))
def test_a_lag_gives_the_mean_of_its_exact_response(seed: int, lag: float, hold: int) -> None:
    """Of ``tau dy/dt + y = u`` with the integral of y beside it, by a matrix exponential."""
    drives, lags = Bench(drive_lag=[lag]), np.array([[-1 / lag, 1 / lag], [0.0, 0.0]])
    system = np.zeros((3, 3))
    system[:2, :2], system[2, 0] = lags, 1.0  # y, u, integral of y
    step = expm(PERIOD * system)
    state = np.zeros((3, N + 3))
    for torque in np.repeat(torques(seed, 8), hold, axis=0):
        state[1], state[2] = torque, 0.0
        state = step @ state
        _, got = drives.act(torque)
        np.testing.assert_allclose(got, state[2] / PERIOD, rtol=1e-10, atol=1e-10)
        lagging = drives.block[0].drive.lagging
        np.testing.assert_allclose(lagging, state[0], rtol=1e-10, atol=1e-10)


@given(SEEDS)
def test_effects_come_in_their_order_on_each_axis_by_itself(seed: int) -> None:
    """Limit, quantisation, dead band, lag, scale, bias; each with numbers of its own an axis."""
    step, band = np.array(per_axis(seed, 0.1, 2.0)), np.array(per_axis(seed + 1, 0.0, 3.0))
    lag, scale = np.array(per_axis(seed + 2, 0.0, 0.01)), np.array(per_axis(seed + 3, 0.5, 1.5))
    bias, limit = np.array(per_axis(seed + 4, -1.0, 1.0)), 9.0
    drives = Bench(
        drive_step=step.tolist(),
        drive_dead_band=band.tolist(),
        drive_lag=lag.tolist(),
        drive_scale=scale.tolist(),
        drive_bias=bias.tolist(),
        base_torque_limit=limit,
        joint_torque_limit=limit,
    )
    lagging, ratio = np.zeros(N + 3), PERIOD / lag
    for torque in torques(seed + 5):
        limited = np.clip(torque, -limit, limit)
        asked = step * np.floor(limited / step + 0.5)
        asked[np.abs(asked) < band] = 0.0
        mean = asked + (lagging - asked) * -np.expm1(-ratio) / ratio
        lagging = asked + (lagging - asked) * np.exp(-ratio)
        reported, got = drives.act(torque)
        np.testing.assert_array_equal(reported, limited)
        np.testing.assert_allclose(got, scale * mean + bias, rtol=1e-9, atol=1e-9)


def test_faults_are_wrong_in_their_time_on_their_axes_and_leave_no_trace() -> None:
    drives = Bench(
        "drive_scale@0.005-0.015:base=0.5",
        "drive_scale@0.01-0.015:all=2",
        "drive_bias@0.005-0.01:joint3=-2",
        "drive_bias@0.005-0.01:joints=1",
        drive_scale=[1.1],
        drive_bias=per_axis(4, -1.0, 1.0),
    )
    sound = drives.block.copy()
    bias = sound[0].drive.bias
    for tick, torque in enumerate(torques(5)):
        scale, more = np.full(N + 3, 1.1), np.zeros(N + 3)
        if 10 <= tick < 30:
            scale[:3] *= 0.5
        if 20 <= tick < 30:
            scale *= 2.0
        if 10 <= tick < 20:
            more[3:] = 1.0
            more[5] += -2.0
        _, got = drives.act(torque)
        np.testing.assert_allclose(got, scale * torque + bias + more, rtol=1e-14, atol=1e-14)
    assert drives.record.drive.tobytes() == sound[0].drive.tobytes()


def test_numbers_changed_in_flight_count_once_judged() -> None:
    drives = Bench()
    drives.block[0].drive.dead_band[4] = 1e9
    Drive.refresh(drives.block[0].drive)
    assert np.flatnonzero(drives.act(np.ones(N + 3))[1] == 0.0).tolist() == [4]


TORQUES = 10.0 * np.random.default_rng(8).normal(size=(50, N + 3))
WRONG = {"drive_scale": [0.9], "drive_bias": [0.1], "drive_lag": [0.01]}


@pytest.mark.parametrize("source", ["command", "given"])
def test_the_echo_has_a_scale_and_a_bias_of_its_own(source: str) -> None:
    scale, bias = np.linspace(0.9, 1.1, N + 3), np.linspace(-1.0, 1.0, N + 3)
    errors = {"echo_scale": scale.tolist(), "echo_bias": bias.tolist(), "torque_echo": source}
    sound, wrong = Bench(**WRONG), Bench(**WRONG, **errors)
    for torque in TORQUES:
        reported, given = sound.act(torque)
        of = reported if source == "command" else given
        found, still_given = wrong.act(torque)
        np.testing.assert_array_equal(still_given, given)
        np.testing.assert_allclose(found, scale * of + bias, rtol=1e-15, atol=1e-15)


def test_faults_of_the_echo_leave_what_is_given() -> None:
    texts = ("torque_scale@0.005-0.015:base=0.5", "torque_bias@0.01-0.015:5=3")
    actuators = Bench(*texts)
    for tick, torque in enumerate(TORQUES):
        reported, given = actuators.act(torque)
        np.testing.assert_array_equal(given, torque)
        scale, bias = np.ones(N + 3), np.zeros(N + 3)
        scale[:3] = 0.5 if 10 <= tick < 30 else 1.0
        bias[7] = 3.0 if 20 <= tick < 30 else 0.0
        np.testing.assert_allclose(given, scale * reported + bias, rtol=1e-15, atol=1e-14)
        if tick < 10 or tick >= 30:
            assert reported.tobytes() == torque.tobytes()
