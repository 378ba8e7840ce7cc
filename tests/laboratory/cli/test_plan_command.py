"""``space-robot plan``: what it shows, stretches, writes and refuses."""

from __future__ import annotations

import json
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
