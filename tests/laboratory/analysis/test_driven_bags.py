"""Bags of flights in orbit and of robots with gears: enough for analysis, without a file."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from driven_robots import PLATES, driven_paper
from flights import space_robot_here
from paths import CONFIG

from space_robot.analysis import analyze
from space_robot.analysis.described import NotDescribedError, momentum_of, orbit_of, robot_of
from space_robot.scenario.comparison import recorded_scenario
from space_robot_model.robot.gears import geared_joints
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

HEIGHT = 543e3


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A flight whose files are gone when the bag is read."""
    folder = tmp_path_factory.mktemp("driven")
    robot, orbit = folder / "paper.yaml", folder / "mine.yaml"
    robot.write_text(yaml.safe_dump(driven_paper()))
    content = yaml.safe_load((CONFIG / "orbits" / "iss.yaml").read_text())
    content["plant_node"]["ros__parameters"]["orbital_elements"]["height"] = HEIGHT
    orbit.write_text(yaml.safe_dump(content))
    words = ["--robot", str(robot), "--orbit", str(orbit), "--case", "3", "--duration", "0.1"]
    flown = space_robot_here("simulate", *words, "--bag", str(folder / "bag"))
    assert flown.returncode == 0, flown.stderr
    robot.unlink()
    orbit.unlink()
    yield folder / "bag"
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def log(bag: Path) -> FlightLog:
    return read_flight(bag)


def test_robot_and_orbit_are_those_that_flew(log: FlightLog) -> None:
    robot, orbit = robot_of(log), orbit_of(log)
    assert geared_joints(robot) == [1, 2, 4]
    assert robot.geared_names == log.geared_names == ("joint2", "joint3", "joint5")
    assert [plate.area for plate in robot.plates] == [plate["area"] for plate in PLATES]
    assert orbit.orbital_elements.height == HEIGHT
    assert orbit.magnetism.strength == 2.971e-5


def test_commands_read_it_without_trust(bag: Path, tmp_path: Path) -> None:
    analyzed = space_robot_here("analyze", str(bag), "--json")
    assert analyzed.returncode == 0, analyzed.stderr
    assert json.loads(analyzed.stdout)["rms"]
    same = space_robot_here("diff", str(bag), str(bag))
    assert (same.returncode, same.stdout.strip()) == (0, "the same numbers")


def test_its_scenario_flies_the_same_bits(bag: Path, log: FlightLog, tmp_path: Path) -> None:
    file, again = tmp_path / "recorded.yaml", tmp_path / "again"
    file.write_text(yaml.safe_dump(recorded_scenario(bag)))
    flown = space_robot_here("simulate", "--scenario", str(file), "--bag", str(again))
    assert flown.returncode == 0, flown.stderr
    other = read_flight(again)
    for name, values in ((field.name, getattr(log, field.name)) for field in fields(log)):
        if isinstance(values, np.ndarray):
            assert values.tobytes() == getattr(other, name).tobytes(), name


def test_motors_that_the_robot_has_not_are_told(log: FlightLog) -> None:
    """Their momentum would be left out, or that of another joint."""
    momentum_of(log)
    other = replace(log, geared_names=("joint2",), motor_velocities=log.motor_velocities[:, :1])
    with pytest.raises(NotDescribedError, match="has gears in the joints joint2, joint3, joint5"):
        momentum_of(other)


@pytest.mark.parametrize(
    ("parameters", "height"),
    [
        ({"orbit": "iss"}, 420e3),
        ({"orbit": "given", "orbital_elements.height": HEIGHT}, HEIGHT),
        ({"orbit": "gone.yaml", "orbital_elements.height": HEIGHT}, HEIGHT),
        ({"case": "3"}, 0.0),
    ],
)
def test_of_a_bag_with_few_numbers(
    log: FlightLog, parameters: dict[str, Any], height: float
) -> None:
    """Numbers come before the file's name, whose file may be elsewhere."""
    flight = {**log.flight, "parameters": {"plant": {"robot": "paper", **parameters}}}
    few = replace(log, flight=flight, trusted=True)
    assert orbit_of(few).orbital_elements.height == height


def test_a_bag_opens_no_orbit_of_its_own(log: FlightLog) -> None:
    flight = {**log.flight, "parameters": {"plant": {"orbit": "/etc/mine.yaml"}}}
    report = analyze(replace(log, flight=flight))
    assert "refers to a file as its orbit, '/etc/mine.yaml'" in json.dumps(report)
