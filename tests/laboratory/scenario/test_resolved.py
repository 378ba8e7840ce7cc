"""Resolved scenarios, and plants other than what the flight software assumes."""

from __future__ import annotations

import copy
import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml
from command import Run
from flights import space_robot_here
from paths import CONFIG
from robots import driven_paper

from space_robot.api import Scenario
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.scenario.comparison import recorded_scenario
from space_robot.scenario.node_settings import FlightSettings
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.directory import GRAPH_FILE, config_directory
from space_robot_msgs_py.errors import InputError


def run(*words: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    process = space_robot_here(*words)
    assert process.returncode == code, process.stderr
    return process


def test_it_needs_no_file_of_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = Scenario(sensors="fine", actuators="wheels", case="2", duration=0.01).resolved()
    (tmp_path / GRAPH_FILE).write_bytes((config_directory() / GRAPH_FILE).read_bytes())
    monkeypatch.setattr("space_robot_msgs_py.config.files.config_directory", lambda: tmp_path)
    monkeypatch.setattr("space_robot_msgs_py.config.settings.config_directory", lambda: tmp_path)
    with pytest.raises(InputError, match="unknown robot"):
        FlightSettings.resolve({"plant": {"case": "2"}}, {})
    assert Scenario(**numbers).resolved() == numbers


def test_a_command_prints_it_another_flies_it_a_third_compares(tmp_path: Path) -> None:
    file, first, second = tmp_path / "mine.yaml", tmp_path / "first", tmp_path / "second"
    words = ("--case", "3", "--sensors", "fine", "--duration", "0.05")
    run("scenario", *words, "--output", str(file))
    run("simulate", *words, "--bag", str(first))
    run("simulate", "--scenario", str(file), "--bag", str(second))
    assert recorded_scenario(first) == recorded_scenario(second)
    assert "the same numbers" in run("diff", str(first), str(second)).stdout
    assert "the same numbers" in run("diff", str(first), str(file)).stdout
    other = tmp_path / "other.yaml"
    content = yaml.safe_load(file.read_text())
    content["case"]["payload"]["mass"] = 12.5
    content["seed"] = 1
    other.write_text(yaml.safe_dump(content))
    compared = run("diff", str(file), str(other), "--json", code=1)
    assert json.loads(compared.stdout) == [
        {"key": "case.payload.mass", "first": 10.0, "second": 12.5},
        {"key": "seed", "first": 0, "second": 1},
    ]


DURATION = ("--duration", "0.05")


WHEELS = yaml.safe_load((CONFIG / "actuators" / "wheels.yaml").read_text("utf-8"))
"""What the file of the wheels holds."""


def heavier_wheels() -> dict[str, Any]:
    """Return wheels whose rotors are assumed to be heavier by a tenth."""
    numbers: dict[str, Any] = copy.deepcopy(WHEELS["plant_node"]["ros__parameters"])
    inertia = numbers["wheels"]["rotor_inertia"]
    numbers["wheels"]["rotor_inertia"] = [1.1 * value for value in inertia]
    return {key: numbers[key] for key in ("base_actuation", "wheels")}


@pytest.fixture
def truth(tmp_path: Path) -> Path:
    """A file of the paper's robot with gears."""
    path = tmp_path / "truth.yaml"
    path.write_text(yaml.safe_dump(driven_paper()), "utf-8")
    return path


def assert_same_bits(one: FlightLog, other: FlightLog) -> None:
    for name, column in one.columns.items():
        assert other.columns[name].tobytes() == column.tobytes(), name


def flown(space_robot: Run, bag: Path, *words: str) -> FlightLog:
    ran = space_robot("simulate", *words, "--bag", str(bag))
    assert ran.code == 0, ran.err
    return read_flight(bag)


def test_the_plant_has_one_robot_and_the_laws_another(truth: Path) -> None:
    flight = Flight(resolve(FlightPlan(plant_robot=str(truth), duration=0.05)))
    assert flight.plant.robot.geared_names == ("joint2", "joint3", "joint5")
    assert flight.scenario.robots.controller.geared_names == ()
    tree = flight.scenario.tree
    assert not any("drive" in link for link in tree["robot"]["robot"]["links"])
    assert tree["plant_robot"]["robot"]["links"] == driven_paper()["robot"]["links"]
    assert flight.description["robot_file"] == tree["plant_robot"]
    assert flight.description["controller_robot_file"] == tree["robot"]
    mission = Flight(resolve(FlightPlan(duration=0.05))).scenario.tree["mission"]
    assert tree["mission"] == mission, "the mission is that of the robot assumed"


@pytest.mark.parametrize("as_numbers", [True, False], ids=["numbers", "file"])
def test_assumed_actuators_are_numbers_or_a_file(
    space_robot: Run, tmp_path: Path, as_numbers: bool
) -> None:
    """The plant's are others; the resolved scenario flies the same bits either way."""
    numbers, file = heavier_wheels(), tmp_path / "mine.yaml"
    assumed: Any = numbers
    if not as_numbers:
        path = tmp_path / "heavier.yaml"
        path.write_text(yaml.safe_dump({"plant_node": {"ros__parameters": numbers}}))
        assumed = str(path)
    content = {"actuators": "wheels", "assumed_actuators": assumed, "duration": 0.05}
    file.write_text(yaml.safe_dump(content))
    log = flown(space_robot, tmp_path / "first", "--scenario", str(file))
    flight = Flight(resolve(FlightPlan(**content)))
    own, other = flight.scenario.plant, flight.scenario.assumed_actuators
    expected = [1.1 * value for value in own.wheels.rotor_inertia]
    assert other.wheels.rotor_inertia == pytest.approx(expected, rel=1e-15)
    assert other.wheels.axes == own.wheels.axes
    tree = flight.scenario.tree
    assert tree["assumed_actuators"]["wheels"]["rotor_inertia"] == other.wheels.rotor_inertia
    assert "controller_base_actuators" in flight.description
    again = tmp_path / "resolved.yaml"
    again.write_text(yaml.safe_dump(tree))
    assert_same_bits(log, flown(space_robot, tmp_path / "second", "--scenario", str(again)))
    if not as_numbers:
        words = ("--actuators", "wheels", "--assumed-actuators", assumed, *DURATION)
        assert_same_bits(log, flown(space_robot, tmp_path / "option", *words))


def test_what_is_assumed_as_it_is_is_not_told() -> None:
    tree = Flight(
        resolve(FlightPlan(actuators="wheels", assumed_actuators="wheels", duration=0.05))
    ).scenario.tree
    assert "assumed_actuators" not in tree
