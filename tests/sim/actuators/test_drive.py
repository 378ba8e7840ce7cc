"""What drives make of a torque: each effect against its definition, a lag against its equation."""

from __future__ import annotations

import numpy as np
import pytest
from actuator_bench import NAMES, PERIOD, Bench, N
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy.linalg import expm

from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Command
from space_robot_sim.actuators.drive import DRIVE_BIAS, DRIVE_SCALE, WrongDrive, judge
from space_robot_sim.actuators.torque_limit import TorqueLimitSettings
from space_robot_sim.faults.grammar import by_name, parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]

SEEDS = st.integers(0, 2**31 - 1)
SIZES = st.floats(1e-6, 1e3)


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


def test_no_momentum_is_lost_in_a_lag() -> None:
    """A pulse brings all of its impulse, however slow the drive, once that has come to rest."""
    drives = Bench(drive_lag=per_axis(1, 1e-5, 0.02))
    pulse = torques(2, 3)
    impulse = sum((drives.act(t)[1] for t in [*pulse, *np.zeros((2000, N + 3))]), np.zeros(9))
    np.testing.assert_allclose(impulse, pulse.sum(axis=0), rtol=1e-12)


@given(SEEDS, SIZES)
def test_quantised_torques_are_whole_steps_within_half_a_one(seed: int, step: float) -> None:
    drives = Bench(drive_step=[step])
    for torque in torques(seed):
        reported, got = drives.act(torque)
        np.testing.assert_array_equal(reported, torque)
        np.testing.assert_allclose(got / step, np.round(got / step), rtol=1e-12)
        assert np.abs(got - torque).max() <= 0.5 * step * (1.0 + 1e-9) + 1e-12


@given(SEEDS, SIZES)
def test_a_dead_band_gives_nothing_or_all(seed: int, width: float) -> None:
    drives = Bench(drive_dead_band=[width])
    for torque in torques(seed):
        expected = np.where(np.abs(torque) < width, 0.0, torque)
        np.testing.assert_array_equal(drives.act(torque)[1], expected)


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


def faults(*texts: str) -> WrongDrive:
    kinds = by_name(DRIVE_SCALE, DRIVE_BIAS)
    return WrongDrive(Schedule(parse_faults(texts, kinds), 0, PERIOD, NAMES))


def test_faults_are_wrong_in_their_time_on_their_axes_and_leave_no_trace() -> None:
    drives = Bench(drive_scale=[1.1], drive_bias=per_axis(4, -1.0, 1.0))
    sound = drives.block.copy()
    wrong = faults(
        "drive_scale@0.005-0.015:base=0.5",
        "drive_scale@0.01-0.015:all=2",
        "drive_bias@0.005-0.01:joint3=-2",
        "drive_bias@0.005-0.01:joints=1",
    )
    bias = sound[0].drive.bias
    for tick, torque in enumerate(torques(5)):
        wrong.apply(tick, drives.block[0].drive)
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


def test_sound_drives_that_a_fault_spoils_are_sound_again() -> None:
    drives, wrong = Bench(), faults("drive_scale@0.005-0.01:3=0.5")
    for tick, torque in enumerate(torques(6)):
        wrong.apply(tick, drives.block[0].drive)
        spoilt = np.flatnonzero(drives.act(torque)[1] != torque).tolist()
        assert spoilt == ([5] if 10 <= tick < 20 else [])


def test_numbers_changed_in_flight_count_once_judged() -> None:
    drives = Bench()
    drives.block[0].drive.dead_band[4] = 1e9
    judge(drives.block[0].drive)
    assert np.flatnonzero(drives.act(np.ones(N + 3))[1] == 0.0).tolist() == [4]


@pytest.mark.parametrize("name", ["scale", "bias", "lag", "step", "dead_band"])
def test_lists_have_one_value_or_one_an_axis(paper_robot: Robot, name: str) -> None:
    start = {"initial_joints_deg": [0.0] * N}
    settings = PlantSettings.model_validate({**start, f"drive_{name}": [0.1, 0.2]})
    wrong = f"^drive_{name} has 2 values, one for all or 9 are allowed: base x, y, z and 6 joints$"
    with pytest.raises(InputError, match=wrong):
        Plant(paper_robot, settings, PERIOD)
    with pytest.raises(ValidationError):
        PlantSettings.model_validate({**start, f"drive_{name}": []})


def test_the_plant_flies_under_the_torque_given_and_tells_the_one_reported(
    paper_robot: Robot,
) -> None:
    """Under half the torque, as one whose commands are half; what it reports is the command."""
    start = {"initial_joints_deg": [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]}
    weak = Plant(paper_robot, PlantSettings.model_validate({**start, "drive_scale": [0.5]}), PERIOD)
    sound = Plant(paper_robot, PlantSettings.model_validate(start), PERIOD)
    for tick, torque in enumerate(torques(7, 200)):
        weak.step(Command(tick, torque))
        sound.step(Command(tick, 0.5 * torque))
        np.testing.assert_array_equal(weak.state.applied_torque, torque)
    np.testing.assert_array_equal(weak.memory.x, sound.memory.x)


@pytest.mark.parametrize("name", ["base_torque_limit", "joint_torque_limit"])
def test_limits_have_a_range_with_both_ends(name: str) -> None:
    for limit in (0.0, 1e9):
        assert getattr(TorqueLimitSettings(**{name: limit}), name) == limit
    for limit in (-1e-9, 1.0000001e9):
        with pytest.raises(ValueError, match=name):
            TorqueLimitSettings(**{name: limit})
