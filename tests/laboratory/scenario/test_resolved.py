"""A resolved scenario flies the same bits, and needs no file."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from flights import space_robot_here
from robots import driven_paper

from space_robot.api import Scenario
from space_robot.flight.plan import Flight, resolve
from space_robot.flight.simulate import simulate
from space_robot.scenario.comparison import differences, recorded_scenario
from space_robot.scenario.node_settings import FlightSettings
from space_robot.scenario.options import FlightPlan
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.tree import Visual
from space_robot_msgs_py.config.directory import GRAPH_FILE, config_directory
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import ORBIT_FIELDS

COLUMNS = (
    *("quaternion", "joint_positions", "applied_torque", "commanded_torque"),
    *("motor_positions", "motor_velocities", *ORBIT_FIELDS),
)
SCENARIOS: dict[str, dict[str, Any]] = {
    "sensors and filter": {"case": "3", "sensors": "fine", "navigation": "filtered", "seed": 5},
    "another robot": {"robot": "seven_joint", "case": "2", "friction": False},
    "hardware and gains": {"actuators": "wheels_and_thrusters", "gains": "robust", "case": "4-1"},
    "passive joints": {"robot": "flexible_panels"},
    "capture": {"robot": "dual_arm", "events": ["capture@0.05:small_satellite"]},
    "free base": {"actuators": "none"},
    "faults and swaps": {
        "controller": "ctc",
        "faults": ["torque_scale@0.05:base=0.9"],
        "swaps": ["0.1:tde_stc"],
        "substeps": 2,
    },
    "single parameters": {
        "actuators": "small_wheels",
        "parameters": {
            "controller": {"tde_stc.k_1": [2.0], "hold_ticks": 7},
            "plant": {"wheels.max_torque": [0.1]},
        },
    },
    "orbit": {"orbit": "iss", "case": "3", "actuators": "wheels"},
    "gears and plates": {
        "robot": Robot.from_dict(driven_paper()),
        "orbit": {"orbital_elements": {"height": 400e3}, "atmosphere": {"density": 4e-12}},
    },
    "shapes in an orbit": {
        "robot": replace(
            find_robot("paper"),
            visuals=(
                Visual("box", (3.0, 1.0, 0.1), np.eye(3), np.array([0.0, 2.0, 0.5]), body=0),
                Visual("cylinder", (0.2, 1.0), np.eye(3), np.zeros(3), body=3),
            ),
        ),
        "orbit": "iss",
    },
    "a start that points, with errors of the assumed orbit": {
        "mission": {
            "start": {"joints_deg": [0, 90, 200, 20, 30, 10], "base": "nadir"},
            "segments": [{"base": {"point": "sun", "offset_deg": [0, 0, 5]}, "duration": 60}],
        },
        "orbit": "iss",
        "sensors": "fine",
        "parameters": {"mission": {"assumed_orbit.errors.along": 2e3}},
    },
    "a start with a rate": {
        "mission": {
            "start": {
                "joints_deg": [0, 90, 200, 20, 30, 10],
                "base": {"rpy_deg": [0, 0, 170], "rate_deg_s": [0.1, -0.2, 0.3]},
            },
            "segments": [{"base": {"rpy_deg": [0, 0, 0]}, "duration": 60}],
        },
        "sensors": "fine",
        "navigation": "filtered",
    },
    "another plant": {"robot": "paper", "plant_robot": "paper", "parameters": {"plant": {}}},
}


def run(*words: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    process = space_robot_here(*words)
    assert process.returncode == code, process.stderr
    return process


@pytest.mark.parametrize("options", SCENARIOS.values(), ids=SCENARIOS)
def test_resolved_numbers_as_yaml_fly_the_same_bits(options: dict[str, Any]) -> None:
    flight = Flight(resolve(FlightPlan(duration=0.2, **options)))
    numbers = yaml.safe_load(yaml.safe_dump(flight.scenario.tree))
    again = Flight(resolve(FlightPlan(**numbers)))
    assert again.scenario.tree == flight.scenario.tree == json.loads(json.dumps(numbers))
    assert differences(again.scenario.tree, flight.scenario.tree) == []
    assert again.ticks == flight.ticks
    one, other = simulate(again), simulate(flight)
    for name in COLUMNS:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


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


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("case: {payload: {mas: 1.0}}", "mas"),
        ("robot: {name: x}", "robot"),
        ("duration: {a: 1}", "duration: a number was expected"),
        ("assumed_actuators: 3", "assumed_actuators"),
    ],
)
def test_wrong_numbers_are_one_line(tmp_path: Path, content: str, said: str) -> None:
    file = tmp_path / "wrong.yaml"
    file.write_text(content)
    process = run("simulate", "--scenario", str(file), code=2)
    assert said in process.stderr
    assert "Traceback" not in process.stderr
    assert len(process.stderr.strip().splitlines()) == 1
