"""``space-robot plan``: what it shows, stretches, writes and refuses."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result

from space_robot.cli.main import cli
from space_robot_control.guidance.mission import Mission, MissionNodeSettings
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.kinematics import tool_state
from space_robot_msgs_py.errors import FlightError

MISSION: dict[str, Any] = {
    "mission": {
        "start": {"joints_deg": [0, 90, 200, 20, 30, 10]},
        "segments": [
            {"tool": {"xyz": [0.3, 0.0, -0.4], "rpy_deg": [0, 0, 0]}, "duration": 15},
            {"base": {"rpy_deg": [0, 0, 10]}, "duration": 20},
            {"hold": 2},
        ],
    }
}


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("plan") / "inspect.yaml"
    file.write_text(yaml.safe_dump(MISSION))
    return file


def run(*arguments: object) -> Result:
    return CliRunner(env={"COLUMNS": "120"}).invoke(cli, ["plan", *map(str, arguments)])


@cache
def report(*arguments: object) -> dict[str, Any]:
    numbers: dict[str, Any] = json.loads(run(*arguments, "--json").stdout)
    return numbers


def test_the_papers_mission_and_one_of_segments(mission: Path) -> None:
    """What it asks for stands in docs/manual/missions.md, which has a test."""
    numbers = report()
    assert [s["motion"] for s in numbers["segments"]] == ["joints", "joints"]
    assert {a["actuators"]: a["is_feasible"] for a in numbers["actuators"]}["wheels"]
    numbers = report(mission)
    assert numbers["segments"][0]["tool_travel_m"] == pytest.approx(0.5, rel=1e-3)
    shown = run(mission).stdout
    assert "37.00 s; largest base torque" in shown
    assert "small_wheels" in shown


def test_the_joints_nearest_to_their_limits() -> None:
    assert report()["joints"] == {}
    margins = report("--robot", "dual_arm")["joints"]
    robot = find_robot("dual_arm")
    sampled = Mission(robot, MissionNodeSettings.resolve({"robot": "dual_arm"}), 0.01).chunk(
        0, 3001
    )
    rates = np.abs(sampled.joints[:, 1]) / [limits.velocity for limits in robot.limits]
    k, joint = np.unravel_index(rates.argmax(), rates.shape)
    assert margins["velocity"]["joint"] == robot.joint_names[joint]
    assert margins["velocity"]["time_s"] == pytest.approx(0.01 * k)
    assert margins["velocity"]["share"] == pytest.approx(rates[k, joint], rel=1e-6)
    lower, upper = (
        np.array([getattr(x, name) for x in robot.limits]) for name in ("lower", "upper")
    )
    ranges = np.abs(2.0 * sampled.joints[:, 0] - lower - upper) / (upper - lower)
    assert margins["position"]["share"] == pytest.approx(ranges.max(), rel=1e-9)
    assert 0.0 < margins["effort"]["share"] < 1.0
    assert "joints nearest to their limits: position " in run("--robot", "dual_arm").stdout


def test_sigma_is_of_translations_divided_by_the_tools_distance(mission: Path) -> None:
    hold, robot = report(mission)["segments"][2], find_robot("paper")
    posture = np.radians(hold["goal_deg"]), np.array(hold["attitude"])
    state = tool_state(robot, posture[1], posture[0])
    jacobian = robot.tool_jacobian(*posture)
    jacobian[:3] /= np.linalg.norm(state.position + state.centre_of_mass)
    smallest = np.linalg.svd(jacobian, compute_uv=False)[-1]
    assert hold["singular_value"] == pytest.approx(smallest, rel=1e-9)


@pytest.mark.parametrize("key", ["base_torque", "momentum"])
def test_a_stretched_mission_keeps_to_the_limit_and_flies(
    mission: Path, tmp_path: Path, key: str
) -> None:
    out = tmp_path / "slow.yaml"
    numbers = report(mission, f"--{key.replace('_', '-')}", 1.0, "--out", out)
    assert 0.9 < numbers[key] <= 1.0 + 1e-9
    assert numbers["before"] == report(mission)
    again = report(out)
    assert again[key] == numbers[key]
    assert [s["motion"] for s in again["segments"]] == ["tool", "base", "hold"]


def test_redundant_joints_make_it_lighter_before_it_is_stretched(tmp_path: Path) -> None:
    start = {"joints_deg": [10, 30, 40, 50, 60, 70, 80]}
    segments = [{"tool": {"xyz": [0.2, 0, -0.1]}, "duration": 15}]
    file = tmp_path / "line.yaml"
    file.write_text(yaml.safe_dump({"mission": {"start": start, "segments": segments}}))
    numbers = report(file, "--robot", "seven_joint", "--base-torque", 0.05)
    assert numbers["before"]["base_torque"] > 0.1
    assert numbers["base_torque"] == numbers["lightened"]["base_torque"] < 0.05
    assert numbers["duration_s"] == 15.0
    # legs between waypoints are bent and stretched: docs/manual/missions.md, which has a test


WEAK = {
    "base_actuation": "hardware",
    "wheels": {"axes": np.eye(3).ravel().tolist(), "max_torque": [0.5], "max_momentum": [50.0]},
}


@pytest.fixture
def weak_wheels(tmp_path: Path) -> Path:
    file = tmp_path / "weak.yaml"
    file.write_text(yaml.safe_dump({"plant_node": {"ros__parameters": WEAK}}))
    return file


def test_actuators_of_ones_own_are_judged_and_refused(mission: Path, weak_wheels: Path) -> None:
    refused = run(mission, "--actuators", weak_wheels, "--json")
    error = refused.exception
    assert isinstance(error, FlightError)
    assert error.exit_code == 1
    said = (
        r"refused: the mission's part 1 \(tool\) asks for [\d.]+ N m about base_y at t = [\d.]+ s, "
    )
    assert re.fullmatch(said + r"[\d.]+ % of what the actuators give", str(error))
    numbers = json.loads(refused.stdout)
    assert f"refused: {numbers['refused']}" == str(error)
    own, *shipped = numbers["actuators"]
    assert own["actuators"] == str(weak_wheels)
    assert own["torque"] == pytest.approx(numbers["base_torque"] / 0.5)  # about one of its axes
    assert shipped == report(mission)["actuators"]
    assert str(weak_wheels.stem) in run(mission, "--actuators", weak_wheels).stdout
    slow = run(mission, "--actuators", weak_wheels, "--base-torque", 0.4)
    assert slow.exit_code == 0
    assert report(mission, "--actuators", "wheels")["refused"] == ""


def test_an_orbit_has_torques_by_source(mission: Path) -> None:
    alone, numbers = report(mission), report(mission, "--orbit", "iss")
    assert list(alone["sources"]) == ["motion"]
    assert alone["momentum_end"] == 0.0
    sources = numbers["sources"]
    assert list(sources) == ["motion", "gravity_gradient", "drag", "sunlight", "magnetic"]
    assert sources["motion"] == alone["sources"]["motion"]
    ends = [source["momentum_end"] for source in sources.values()]
    assert 0.0 < numbers["momentum_end"] <= sum(ends)
    assert numbers["momentum_end"] == numbers["segments"][-1]["momentum_end"]
    assert sources["gravity_gradient"] == {
        key: max(s["sources"]["gravity_gradient"][key] for s in numbers["segments"])
        for key in ("base_torque", "momentum", "momentum_end")
    }
    assert "all, without unloading" in " ".join(run(mission, "--orbit", "iss").stdout.split())


def test_a_scenario_has_the_mission_its_orbit_and_actuators(
    tmp_path: Path, weak_wheels: Path
) -> None:
    file = tmp_path / "flight.yaml"
    flown = {"controller": "ctc", "case": "3", "seed": 4, "orbit": "iss"}
    flown |= {"mission": MISSION["mission"], "actuators": str(weak_wheels)}
    file.write_text(yaml.safe_dump(flown))
    refused = run("--scenario", file, "--json")
    assert isinstance(refused.exception, FlightError)
    numbers = json.loads(refused.stdout)
    assert [s["motion"] for s in numbers["segments"]] == ["tool", "base", "hold"]
    assert numbers["sources"]["gravity_gradient"]["momentum_end"] > 0.0
    other = report("--scenario", file, "--orbit", "none", "--actuators", "ideal")
    assert (list(other["sources"]), other["refused"]) == (["motion"], "")
    file.write_text(yaml.safe_dump({**flown, "orbits": "iss"}))
    assert "orbits" in str(run("--scenario", file).exception)


def test_a_base_that_floats_freely_is_remarked(mission: Path) -> None:
    result = run(mission, "--actuators", "none")
    assert result.exit_code == 0
    assert "warning: the mission's part 1 (tool) is planned with a base whose" in result.stderr


def test_the_figure_is_drawn(mission: Path, tmp_path: Path) -> None:
    assert run(mission, "--figure", tmp_path / "plan").exit_code == 0
    assert (tmp_path / "plan.png").stat().st_size > 10_000
    assert "momentum (N m s)" in (tmp_path / "plan.svg").read_text("utf-8")


def test_degrees_in_a_file_of_radians_are_remarked(tmp_path: Path) -> None:
    path = tmp_path / "track.csv"
    names = ",".join(("time", *find_robot("paper").joint_names))
    path.write_text(f"{names}\n0,0,120,220,0,-10,0\n10,0,119,219,0,-10,0\n")
    result = run(path)
    assert result.exit_code == 0
    said = "the trajectory leads joint 'joint3' to 12605.1 degrees (220 rad): its numbers are in"
    assert f"warning: {said} rad" in result.stderr
    assert "joint1" not in result.stderr
