"""What cannot be flown is refused in one line: rows of tests/data/refusals/guidance.yaml."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from paths import DATA
from strategies import random_robot

from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_control.guidance.trajectory_file import with_columns
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.errors import InputError

START = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]
TEXT = (DATA / "refusals/guidance.yaml").read_text("utf-8")
ROWS: list[dict[str, Any]] = yaml.safe_load(TEXT.replace("START", str(START)))
MANY = {"joints_deg": START, "bends_deg": [[1] * 6] * 101, "duration": 5}
ROWS.append({"segments": [MANY], "said": "at most 100"})
ISS = {"orbital_elements": {"height": 420e3, "eccentricity": 0.0005, "inclination_deg": 51.64}}


def robot_of(name: str | int) -> Robot:
    if isinstance(name, int):
        return random_robot(np.random.default_rng(name), name)
    own = DATA / name / "robot.yaml"
    return Robot.from_yaml(own) if own.exists() else find_robot(name)


def columns_of(changes: dict[str, Any]) -> str:
    columns: dict[str, Any] = {"time": [0.0, 1.0, 2.0]}
    for k, angle in enumerate(np.radians(START), 1):
        columns[f"joint{k}"] = [angle, angle + 0.01, angle + 0.02]
    return json.dumps({"trajectory": columns | changes})


def text_of(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["said"])
@pytest.mark.filterwarnings("error")
def test_a_mission_is_refused_in_one_line(row: dict[str, Any]) -> None:
    """InputError and Pydantic's ValidationError are both ValueErrors."""
    settings = {"waypoints_deg": START} | row
    robot, said = robot_of(settings.pop("robot", "paper")), settings.pop("said")
    if settings.pop("orbit", False):
        settings["assumed_orbit"] = ISS
    segments = [text_of(segment) for segment in settings.pop("segments", [])]
    if changes := settings.pop("columns", None):
        segments = [columns_of(changes)]
    if "base_point" in settings:
        settings["base_point"] = text_of(settings["base_point"])
    with pytest.raises(ValueError, match=said) as caught:
        Mission(robot, MissionSettings(segments=segments, **settings), 5e-4)
    if isinstance(caught.value, InputError):
        assert "\n" not in str(caught.value)
        assert "segment" in str(caught.value) or not segments or "base" in str(caught.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "the file is empty"),
        ("time,joint1\n0.0\n", "line 2: 2 cells expected, got 1"),
        ("time,joint1\n0.0,abc\n", "line 2: joint1: a number was expected, got 'abc'"),
        ("time,joint1\n0.0,nan\n", "line 2: joint1: a number was expected, got 'nan'"),
    ],
)
def test_bad_files_are_named_with_line_and_column(tmp_path: Path, content: str, said: str) -> None:
    (tmp_path / "path.csv").write_text(content)
    with pytest.raises(InputError, match=rf"path.csv: {said}"):
        with_columns("{file: path.csv}", tmp_path)
