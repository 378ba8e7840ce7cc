"""From measured to estimated states: gaps, bad states, what is assumed of sensors; quaternions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attitude_sensors import attitude_error, exponential
from benches import SensorBench as Bench
from benches import a_state
from closed_loop import NAVIGATION, PERIOD, Loop, law_of
from hypothesis import given
from hypothesis import strategies as st
from oracles import quaternion_of, rotation_of
from scipy.spatial.transform import Rotation
from strategies import random_quaternion

from space_robot_control.navigation.navigation import LONGEST_BRIDGE, Navigation, navigate
from space_robot_control.navigation.settings import (
    LEAST,
    LEAST_ANGLE,
    NavigationFilterSettings,
    assumed_numbers,
    completed,
)
from space_robot_model.dynamics.attitude import compose, from_small_rotation, to_small_rotation
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import UnusableStateError
from space_robot_msgs_py.samples import RobotState

OMEGA = np.array([0.02, -0.03, 0.01])
N = 6
SETTINGS = NAVIGATION.model_copy(update={"tracker_delay": 0.01, "rate_filter_hz": 0.0})


def state_at(tick: int) -> RobotState:
    """Of a robot that turns at `OMEGA` with a tracker of 100 Hz, 10 ms late, without noise."""
    state = RobotState.allocate(N)
    t = tick * PERIOD
    taken = max(0, (tick - 20) // 20 * 20) * PERIOD
    state.tick = tick
    state.quaternion[:] = exponential(OMEGA * taken)
    state.omega_base[:] = OMEGA
    state.joint_positions[:] = 0.1 * np.sin(t) + np.arange(N)
    state.joint_velocities[:] = 0.1 * np.cos(t)
    state.applied_torque[:] = 0.0
    return state


def estimates(navigation: Navigation, ticks: list[int]) -> Array:
    """Quaternion, rates and angles after each tick."""
    rows = []
    for tick in ticks:
        navigate(navigation, tick, state_at(tick).block[0], PERIOD)
        e = navigation.estimate
        rows.append(np.r_[e.quaternion, e.omega_base, e.joint_positions, e.joint_velocities])
    return np.array(rows)


def built(**changes: float) -> Navigation:
    return Navigation.build(N, SETTINGS.model_copy(update=changes), PERIOD)


def test_the_estimate_is_of_now_though_the_tracker_is_late() -> None:
    found = estimates(built(), list(range(400)))
    truth = exponential(OMEGA * PERIOD * np.arange(400)[:, None])
    error = np.abs(attitude_error(found[:, :4], truth))
    assert error[41:].max() < 1e-7
    # the first one is taken for as old as the others
    begun = exponential(OMEGA * PERIOD * 20)
    np.testing.assert_allclose(found[0, :4], begun, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(found[:, 4:7], np.tile(OMEGA, (400, 1)), atol=1e-6)


def ramped_state_at(tick: int) -> RobotState:
    """As `state_at`; rates and joint rates rise evenly, from tick 301 on a torque is applied."""
    state, t = state_at(tick), tick * PERIOD
    taken = max(0, (tick - 20) // 20 * 20) * PERIOD
    state.quaternion[:] = exponential(OMEGA * (taken + 2.0 * taken * taken))
    state.omega_base[:] = OMEGA * (1.0 + 4.0 * t)
    state.joint_positions[:] = np.arange(N) * (0.1 + 0.5 * t * t)
    state.joint_velocities[:] = np.arange(N) * t
    state.applied_torque[:] = 5.0 if tick > 300 else 0.0
    state.base_position[:], state.base_velocity[:] = [t, 2.0, 3.0], [4.0, t, 5.0]
    return state


def test_lost_states_of_an_even_ramp_are_as_if_they_had_come() -> None:
    """Rates are interpolated, low-passes and joint filters go on by the time that passed."""
    whole, *bridged = (built(rate_filter_hz=20.0) for _ in range(3))
    for tick in range(340):
        state = ramped_state_at(tick)
        navigate(whole, tick, state.block[0], PERIOD)
        for navigation, lost in zip(bridged, (2, LONGEST_BRIDGE - 1), strict=True):
            if 301 <= tick < 301 + lost:
                continue
            navigate(navigation, tick, state.block[0], PERIOD)
            if tick <= 300:
                continue
            for name in ("quaternion", "omega_base", "joint_positions", "joint_velocities"):
                expected, found = (getattr(n.estimate, name) for n in (whole, navigation))
                np.testing.assert_allclose(found, expected, rtol=0.0, atol=2e-9, err_msg=name)
            expected, found = (n.estimate.applied_torque[:3] for n in (whole, navigation))
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)
            for name in ("base_position", "base_velocity"):
                sent = getattr(state, name)
                np.testing.assert_array_equal(getattr(navigation.estimate, name), sent)


@pytest.mark.parametrize("elapsed", [LONGEST_BRIDGE + 1, 30 * LONGEST_BRIDGE])
def test_after_a_long_gap_the_attitude_begins_anew_and_the_bias_walks_on(elapsed: int) -> None:
    """Its estimate stays; its variance grows by sigma_u^2 times the gap."""
    walk = 1e-6
    navigation = built(gyro_rate_walk=walk)
    estimates(navigation, list(range(400)))
    bias = np.array([1e-4, -2e-4, 3e-4])
    navigation.attitude.bias[:] = bias
    before = navigation.attitude.covariance.copy()
    tick = 399 + elapsed
    (row,) = estimates(navigation, [tick])
    np.testing.assert_array_equal(navigation.attitude.bias, bias)
    after = navigation.attitude.covariance
    walked = before[3:, 3:] + walk**2 * elapsed * PERIOD * np.eye(3)
    np.testing.assert_allclose(after[3:, 3:], walked, rtol=1e-12, atol=1e-30)
    np.testing.assert_array_equal(after[:3, :3], navigation.attitude.noise)
    assert not after[:3, 3:].any()
    np.testing.assert_array_equal(row[4:7], OMEGA - bias)
    assert np.abs(attitude_error(row[:4], exponential(OMEGA * PERIOD * tick))).max() < 1e-3


def test_the_noise_of_a_tracker_is_that_of_its_axes() -> None:
    """A boresight of any length: across^2 (E - b b^T) + about^2 b b^T."""
    boresight = [2.0, -1.0, 2.0]
    changed = {"tracker_boresight": boresight, "tracker_across": 2e-5, "tracker_about": 7e-5}
    attitude = Navigation.build(N, SETTINGS.model_copy(update=changed), PERIOD).attitude
    along = np.outer(boresight, boresight) / 9.0
    expected = 4e-10 * (np.eye(3) - along) + 49e-10 * along
    np.testing.assert_allclose(attitude.noise, expected, rtol=1e-13, atol=1e-24)


@pytest.mark.parametrize("again", [100, 399])
def test_after_a_jump_back_in_time_everything_begins_anew(again: int) -> None:
    """As a filter that has seen nothing, to the last bit."""
    used, fresh = built(), built()
    estimates(used, list(range(400)))
    ticks = list(range(again, again + 100))
    np.testing.assert_array_equal(estimates(used, ticks), estimates(fresh, ticks))


@pytest.mark.parametrize("angle", [5e-324, 1e-200, LEAST, 1e3])
@pytest.mark.parametrize("rate", [0.0, 5e-324, LEAST, 1e3])
def test_noises_whose_squares_vanish_give_a_filter(angle: float, rate: float) -> None:
    """They count as the least that there is."""
    given = NAVIGATION.model_dump() | {"joint_angle_noise": angle, "joint_rate_noise": rate}
    joints = Navigation.build(6, NavigationFilterSettings(**given), PERIOD).joints
    assert np.isfinite(joints.angle_gain).all()
    assert np.isfinite(joints.rate_gain).all()


@pytest.mark.parametrize(("field", "value"), [("quaternion", 1.1), ("omega_base", np.nan)])
def test_an_unusable_state_and_another_law_leave_the_filter_as_it_is(
    paper_robot: Robot, field: str, value: float
) -> None:
    shown, spared = (Loop(paper_robot, law_of("tde_stc"), navigation=SETTINGS) for _ in range(2))
    for loop in (shown, spared):
        loop.fly(50)
    state = shown.plant.state.copy()
    getattr(state, field)[0] = value
    with pytest.raises(UnusableStateError):
        shown.controller.update(state, shown.references.at(50))
    blocks = [loop.controller.block["navigation"] for loop in (shown, spared)]
    assert blocks[0].tobytes() == blocks[1].tobytes()
    np.testing.assert_array_equal(shown.fly(20)[1], spared.fly(20)[1])
    before = blocks[0].tobytes()
    shown.controller.law = law_of("ctc")
    assert shown.controller.block["navigation"].tobytes() == before


# What is assumed of sensors: given, or from their own file

FILE = """
plant_node:
  ros__parameters:
    command_latency_ticks: 1
    star_tracker: {noise_across: 3.0e-5, noise_about: 2.0e-4, boresight: [0, 1, 0], delay: 0.2}
    gyro: {angle_random_walk: 3.0e-6, noise: 1.0e-4, initial_bias: [1.0e-6, -5.0e-6, 0.0]}
    encoders: {bits: 20, difference_ticks: 1}
"""


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "sensors.yaml"
    path.write_text(FILE)
    return str(path)


def test_numbers_are_those_of_the_sensors_file(file: str) -> None:
    found = completed(NavigationFilterSettings(), file, PERIOD)
    assert (found.tracker_across, found.tracker_about) == (3e-5, 2e-4)
    assert (found.tracker_boresight, found.tracker_delay) == ([0.0, 1.0, 0.0], 0.2)
    # noise of single samples, summed over a second, is worth sigma sqrt(period)
    assert found.gyro_angle_walk == pytest.approx(np.hypot(3e-6, 1e-4 * PERIOD**0.5))
    assert (found.gyro_rate_walk, found.gyro_bias) == (0.0, 5e-6)
    assert found.joint_angle_noise == pytest.approx(2.0 * np.pi / 2**20 / 12**0.5)
    assert found.joint_rate_noise == 0.0  # differenced angles are no news


def test_what_is_given_comes_first(file: str) -> None:
    """And where every number is given no file is read."""
    given = NavigationFilterSettings(tracker_across=1e-3, tracker_delay=0.0, joint_rate_noise=1e-4)
    found = completed(given, file, PERIOD)
    assert (found.tracker_across, found.tracker_delay, found.joint_rate_noise) == (1e-3, 0.0, 1e-4)
    assert found.tracker_about == 2e-4
    assert completed(NAVIGATION, "there is none", PERIOD) is NAVIGATION


@pytest.mark.parametrize("period", [PERIOD, 0.02])
def test_what_is_assumed_of_sensors_is_what_they_do(period: float) -> None:
    """Noise and whole steps of every sensor, against the errors of 1500 measurements."""
    settings: dict[str, Any] = {
        "star_tracker": {"noise_across": 2e-5, "noise_about": 9e-5, "step": 1e-4},
        "gyro": {"angle_random_walk": 2e-6, "noise": 1e-4, "step": 5e-4},
        "encoders": {"noise": 3e-6, "bits": 19, "velocity_noise": 2e-5, "velocity_step": 1e-4},
    }
    bench, rng, state = Bench(period=period, **settings), np.random.default_rng(0), a_state()
    errors = []
    for state.tick in range(1500):
        state.block[0].quaternion[:] = random_quaternion(rng)
        state.omega_base[:] = rng.normal(size=3)
        state.joint_positions[:], state.joint_velocities[:] = rng.normal(size=(2, 6))
        told = bench.measure(state)
        turn = (rotation_of(state.quaternion).inv() * rotation_of(told.quaternion)).as_rotvec()
        rates = told.omega_base - state.omega_base, told.joint_velocities - state.joint_velocities
        errors.append(
            [*turn, *rates[0], *(told.joint_positions - state.joint_positions), *rates[1]]
        )
    found = np.sqrt(np.mean(np.square(errors), axis=0))
    assumed = assumed_numbers(SensorSettings.model_validate(settings), period)
    sample = assumed["gyro_angle_walk"] / period**0.5
    expected = [
        *[assumed["tracker_across"]] * 2,
        assumed["tracker_about"],
        *[sample] * 3,
        *[assumed["joint_angle_noise"]] * 6,
        *[assumed["joint_rate_noise"]] * 6,
    ]
    np.testing.assert_allclose(found, expected, rtol=5.0 * (2.0 * len(errors)) ** -0.5)


def test_nothing_is_assumed_to_be_perfect() -> None:
    found = assumed_numbers(SensorSettings(), PERIOD)
    assert found["tracker_across"] == found["tracker_about"] == LEAST_ANGLE
    assert found["gyro_angle_walk"] == found["joint_angle_noise"] == LEAST
    assert found["joint_rate_noise"] == LEAST


# Quaternions


seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def vector(rng: np.random.Generator, size: float) -> Array:
    direction = rng.normal(size=3)
    return size * direction / np.linalg.norm(direction)


@given(seeds, st.sampled_from([1e-9, 1e-3, 0.03, 0.1]))
def test_a_turn_is_exact_to_1e_12_of_its_angle(rng: np.random.Generator, angle: float) -> None:
    rotation, out = vector(rng, angle), np.empty(4)
    from_small_rotation(rotation, out)
    found = rotation_of(out / np.linalg.norm(out)).as_rotvec()
    np.testing.assert_allclose(found, rotation, rtol=0.0, atol=1.2e-12 * angle)
    from_small_rotation(rotation * 1e6, out)
    assert np.isfinite(out).all()


@given(seeds)
def test_products_are_scipys_whichever_is_overwritten(rng: np.random.Generator) -> None:
    p, q = random_quaternion(rng), random_quaternion(rng)
    expected = quaternion_of(rotation_of(p) * rotation_of(q))
    for left, right in ((p.copy(), 3.0 * q), (2.0 * p, q.copy())):
        for out in (np.empty(4), left, right):
            compose(left, right, out)
            assert min(np.abs(out - expected).max(), np.abs(out + expected).max()) < 1e-15
            left[:], right[:] = p, q


@given(seeds, st.sampled_from([1e-8, 1e-4, 1e-2]), st.sampled_from([1.0, -1.0]))
def test_a_small_angle_is_the_rotation_between(
    rng: np.random.Generator, angle: float, sign: float
) -> None:
    """To third order, whichever sign; the cosine is that of half of it."""
    origin, rotation, out = random_quaternion(rng), vector(rng, angle), np.empty(3)
    other = sign * quaternion_of(rotation_of(origin) * Rotation.from_rotvec(rotation))
    cosine = to_small_rotation(origin, other, out)
    np.testing.assert_allclose(out, rotation, rtol=0.0, atol=angle**3 / 10.0 + 1e-15)
    assert abs(cosine - np.cos(0.5 * angle)) < 1e-14
    assert to_small_rotation(origin, origin[[1, 0, 3, 2]] * [-1.0, 1.0, 1.0, -1.0], out) < 1e-15
