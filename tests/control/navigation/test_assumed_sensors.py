"""What the filter believes of its sensors: given, or from the sensors' own file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benches import SensorBench as Bench
from benches import a_state
from closed_loop import NAVIGATION
from oracles import rotation_of
from strategies import random_quaternion

from space_robot_control.navigation.assumed_sensors import (
    LEAST,
    LEAST_ANGLE,
    assumed_numbers,
    completed,
)
from space_robot_control.navigation.navigation import Navigation
from space_robot_control.navigation.settings import NavigationFilterSettings
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_msgs_py.errors import InputError

PERIOD = 5e-4
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
    """Ideal sensors make a filter that can be built."""
    found = assumed_numbers(SensorSettings(), PERIOD)
    assert found["tracker_across"] == found["tracker_about"] == LEAST_ANGLE
    assert found["gyro_angle_walk"] == found["joint_angle_noise"] == LEAST
    assert found["joint_rate_noise"] == LEAST
    settings = NavigationFilterSettings(**found)
    navigation = Navigation.build(6, settings, PERIOD)
    assert np.isfinite(navigation.joints.angle_gain).all()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("plant_node: {ros__parameters: {gyro: {noise: -1}}}", "sensors.yaml: gyro.noise: "),
        ("plant_node: {gyro: {noise: 1}}", "sensors.yaml: plant_node: 'ros__parameters'"),
        (None, "sensors.yaml"),
    ],
)
def test_a_wrong_file_is_named(tmp_path: Path, text: str | None, why: str) -> None:
    """Also where one number alone is not given."""
    path = tmp_path / "sensors.yaml"
    if text:
        path.write_text(text)
    with pytest.raises(InputError, match=why):
        completed(NAVIGATION.model_copy(update={"gyro_bias": -1.0}), str(path), PERIOD)
