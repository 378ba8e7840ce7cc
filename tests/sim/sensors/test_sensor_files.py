"""The files of config/sensors, and what is said of bad ones."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG
from sensor_bench import Bench

from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

FILES = {path.stem: path for path in (CONFIG / "sensors").glob("*.yaml")}
PARTS = ("star_tracker", "gyro", "encoders")


def of(name: str) -> PlantNodeSettings:
    return PlantNodeSettings.resolve({"sensors": name})


def test_there_are_the_files_that_the_manual_names() -> None:
    assert set(FILES) == {"ideal", "fine", "tactical", "coarse", "white_l1", "white_l2"}


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_about_sensors_alone_and_makes_a_plant(paper_robot: Robot, name: str) -> None:
    given = yaml.safe_load(FILES[name].read_text("utf-8"))["plant_node"]["ros__parameters"]
    assert set(given) <= set(PARTS)
    assert Plant(paper_robot, of(name), 5e-4).measures_truth is (name == "ideal")
    assert of(str(FILES[name])).gyro == of(name).gyro


def test_without_a_choice_sensors_are_ideal() -> None:
    assert PlantNodeSettings.resolve({}) == of("ideal")
    ideal, settings = SensorSettings(), of("ideal")
    assert all(getattr(settings, part) == getattr(ideal, part) for part in PARTS)


def test_grades_get_worse_in_every_number() -> None:
    """The period is the default one."""
    grades = []
    for name in ("fine", "tactical", "coarse"):
        bench = Bench(**{part: getattr(of(name), part).model_dump() for part in PARTS})
        tracker, gyro, encoders = (getattr(bench.block[0], part) for part in PARTS)
        lag = float(encoders.difference_ticks) * 5e-4
        differenced = 2.0**0.5 * encoders.sigma[0] / lag if lag else 0.0
        grades.append(
            [
                *tracker.sigma,
                float(tracker.interval),
                float(tracker.delay),
                float(gyro.angle_random_walk),
                abs(gyro.offset[0]),
                abs(gyro.scale[0] - 1.0),
                encoders.sigma[0],
                encoders.step[0],
                max(encoders.velocity_sigma[0], differenced),
            ]
        )
    for better, worse in itertools.pairwise(grades):
        assert all(one < other for one, other in zip(better, worse, strict=True))


def test_white_noise_levels() -> None:
    """Both rates are ten times as noisy at level 2; nothing is late."""
    one, two = of("white_l1"), of("white_l2")
    for settings in (one, two):
        tracker = settings.star_tracker
        assert (tracker.noise_across, tracker.noise_about) == (1e-5, 1e-5)
        assert (tracker.rate, tracker.delay, settings.encoders.noise) == (0.0, 0.0, 1e-5)
    assert (one.gyro.noise, one.encoders.velocity_noise) == (1e-6, 1e-5)
    assert (two.gyro.noise, two.encoders.velocity_noise) == (1e-5, 1e-4)


def test_single_numbers_come_over_those_of_the_file() -> None:
    settings = PlantNodeSettings.resolve({"sensors": "fine", "star_tracker.delay": 0.3})
    assert settings.star_tracker.delay == 0.3
    assert settings.star_tracker.rate == of("fine").star_tracker.rate


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (
            "star_tracker: {noise_acros: 1e-5}",
            "star_tracker.noise_acros: unknown key, got 1e-05: "
            "choose one of boresight, delay, noise_about, noise_across, rate, step ",
        ),
        (
            "gyro: {noise: -1}",
            "gyro.noise: Input should be greater than or equal to 0, got -1 "
            r"\(white noise of each sample, independent of the period, rad/s\)$",
        ),
        ("gyro: {initial_bias: 0}", "gyro.initial_bias: Input should be a valid list, got 0$"),
        ("gyro: {initial_bias: [0, 0]}", "gyro.initial_bias: List should have at least 3 items"),
        (
            "encoders: {bits: 12.5}",
            r"encoders.bits: Input should be a valid integer, got 12.5 \(resolution: 2\^bits steps "
            r"per revolution, or per metre \(0: continuous\)\)$",
        ),
        ("encoders: {bits: 64}", "encoders.bits: Input should be less than or equal to 32, got 64"),
        ("encoders: fine", "encoders: a mapping was expected, got 'fine'"),
        ("sun_sensor: {}", "sun_sensor: unknown key, got {}: "),
        ("gyro: {noise: .nan}", "gyro.noise: Input should be "),
        ("gyro: {noise: 1, noise: 2}", "line 1: not YAML .the key 'noise' occurs twice"),
    ],
)
def test_a_bad_file_is_one_line_with_file_and_key(tmp_path: Path, text: str, why: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("plant_node: {ros__parameters: {" + text + "}}")
    with pytest.raises(InputError, match=f"^{path}: {why}") as caught:
        of(str(path))
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


def test_a_name_that_is_none_is_told_with_those_there_are() -> None:
    with pytest.raises(InputError, match="unknown sensor 'best': choose one of coarse, fine, idea"):
        of("best")


KEYS = [name for name, _ in leaves(SensorSettings)]
_LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
_VALUES = st.recursive(
    _LEAVES,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from([*KEYS, *PARTS]) | st.text(max_size=9), _VALUES, max_size=4))
def test_any_file_makes_sensors_or_one_line(content: dict[str, Any]) -> None:
    """Whatever stands in it: numbers that cannot be flown are refused, and never crash."""
    try:
        settings = PlantNodeSettings.resolve(content)
        Bench(**{part: getattr(settings, part).model_dump() for part in PARTS})
    except InputError as error:
        said = str(error)
    else:
        said = ""
    assert "\n" not in said
