"""Flights whose plant has another robot or other actuators than the flight software assumes."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
import yaml
from command import Run
from paths import CONFIG
from robots import driven_paper

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

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


def test_a_resolved_scenario_flies_the_same_bits_from_its_file(
    space_robot: Run, truth: Path, tmp_path: Path
) -> None:
    """Of a robot whose file is gone by then, with sensors and in orbit."""
    words = ("--plant-robot", str(truth), "--orbit", "iss", "--sensors", "fine", *DURATION)
    log = flown(space_robot, tmp_path / "first", *words)
    assert log.geared_names == ("joint2", "joint3", "joint5")
    file = tmp_path / "resolved.yaml"
    ran = space_robot("scenario", *words, "--output", str(file))
    assert ran.code == 0, ran.err
    assert "plant_robot" in yaml.safe_load(file.read_text())
    truth.unlink()
    again = flown(space_robot, tmp_path / "second", "--scenario", str(file))
    assert_same_bits(log, again)
    assert again.flight["scenario"] == log.flight["scenario"]
    ran = space_robot("diff", str(tmp_path / "first"), str(tmp_path / "second"))
    assert (ran.code, ran.out.strip()) == (0, "the same numbers")


def test_an_option_comes_before_the_scenarios(
    space_robot: Run, truth: Path, tmp_path: Path
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump({"plant_robot": driven_paper(), "duration": 0.05}))
    rigid = flown(
        space_robot, tmp_path / "rigid", "--scenario", str(file), "--plant-robot", "paper"
    )
    assert rigid.geared_names == ()
    assert "controller_robot_file" not in rigid.flight
    geared = flown(space_robot, tmp_path / "geared", "--scenario", str(file))
    by_option = flown(space_robot, tmp_path / "option", "--plant-robot", str(truth), *DURATION)
    assert_same_bits(geared, by_option)


def test_the_same_robot_twice_is_one() -> None:
    twice = Flight(resolve(FlightPlan(plant_robot="paper", duration=0.05)))
    once = Flight(resolve(FlightPlan(duration=0.05)))
    assert twice.scenario.tree == once.scenario.tree
    assert_same_bits(simulate(twice), simulate(once))


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


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--plant-robot", "nothing"), "unknown robot 'nothing': choose one of "),
        (("--plant-robot", "gone.yaml"), "gone.yaml: no such file"),
        (("--plant-robot", "seven_joint"), "must have the same joints, got 'seven_joint' with"),
        (("--assumed-actuators", "nothing"), "assumed_actuators: unknown actuator 'nothing': "),
        (("--assumed-actuators", "gone.yaml"), "assumed_actuators: gone.yaml: no such file"),
        (
            ("--assumed-actuators", "wheels"),
            "same actuators, got plant ideal, 0 wheels, 0 thrusters; controller hardware, 4 wheels",
        ),
        (
            ("--actuators", "wheels", "--assumed-actuators", "wheels_and_torquers"),
            "plant hardware, 4 wheels, 0 thrusters; controller hardware, 4 wheels, 0 thrusters, 3 ",
        ),
    ],
)
def test_what_does_not_fit_is_one_line(space_robot: Run, words: tuple[str, ...], said: str) -> None:
    ran = space_robot("simulate", *words, *DURATION)
    assert ran.code == 2
    assert said in ran.err
    assert len(ran.err.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"plant_robot": {"name": "x"}}, "plant_robot: "),
        ({"plant_robot": 3.5}, "unknown robot '3.5'"),
        ({"plant_robot": ["paper"]}, "plant_robot: a text or a mapping of numbers was expected"),
        ({"assumed_actuators": {"wheels": {"axis": 1}}}, "assumed_actuators: "),
        ({"assumed_actuators": [1]}, "a text or a mapping of numbers was expected, got [1]"),
        ({"assumed_actuators": {"base_actuation": "hardware"}}, "assumed_actuators"),
    ],
)
def test_wrong_numbers_name_the_key(
    space_robot: Run, tmp_path: Path, content: dict[str, Any], said: str
) -> None:
    file = tmp_path / "wrong.yaml"
    file.write_text(yaml.safe_dump(content))
    ran = space_robot("simulate", "--scenario", str(file), *DURATION)
    assert ran.code == 2
    assert said in ran.err
    assert len(ran.err.strip().splitlines()) == 1


def test_a_plan_takes_no_other_object() -> None:
    with pytest.raises(ValueError, match="plant_robot"):
        FlightPlan(plant_robot=3j)
    with pytest.raises(ValueError, match="assumed_actuators"):
        FlightPlan(assumed_actuators=3j)
