"""A trajectory in a file is a mission that begins at its first row."""

from __future__ import annotations

import json
import math
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from space_robot import Scenario
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.mission_document import mission_layer
from space_robot_msgs_py.config.trees import Tree
from space_robot_msgs_py.errors import InputError

HEADER = "time,joint1,joint2,joint3,joint4,joint5,joint6"
ROWS = ("0,0.1,2.0,3.8,0.0,-0.2,0.0", "1,0.15,2.0,3.8,0.0,-0.2,0.0", "2,0.2,2.0,3.8,0.0,-0.2,0.0")


def write(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def test_it_starts_at_the_first_row(tmp_path: Path) -> None:
    path = write(tmp_path / "my.csv", HEADER, *ROWS)
    of_plant, of_mission = (mission_layer(path, node, "paper") for node in ("plant", "mission"))
    start = [math.degrees(angle) for angle in (0.1, 2.0, 3.8, 0.0, -0.2, 0.0)]
    assert of_plant["initial_joints_deg"] == pytest.approx(start)
    assert of_plant["initial_quaternion"] == [1.0, 0.0, 0.0, 0.0]
    (segment,) = of_mission["segments"]
    assert json.loads(segment)["trajectory"]["joint1"] == [0.1, 0.15, 0.2]


def test_joints_that_slide_are_in_metres_and_the_base_has_its_attitude(tmp_path: Path) -> None:
    boom = find_robot("boom")
    names = ",".join(boom.joint_names[: boom.n])
    values = [0.1 * (joint + 1) for joint in range(boom.n)]
    row = ",".join(f"{value}" for value in values)
    path = write(
        tmp_path / "my.csv", f"time,{names},q_w,q_x,q_y,q_z", f"0,{row},0,1,0,0", f"1,{row},0,1,0,0"
    )
    layer = mission_layer(path, "plant", "boom")
    wanted = [
        value if slides else math.degrees(value)
        for value, slides in zip(values, boom.is_prismatic, strict=False)
    ]
    assert any(boom.is_prismatic[: boom.n])
    assert layer["initial_joints_deg"] == pytest.approx(wanted)
    assert layer["initial_quaternion"] == [0.0, 1.0, 0.0, 0.0]


def test_it_is_flown(tmp_path: Path) -> None:
    path = write(tmp_path / "my.csv", HEADER, *ROWS)
    flight = Scenario(mission=str(path), controller="ctc").fly()
    assert flight.is_complete
    assert flight.ended_at_s == 2.0
    assert flight.log.joint_positions[-1, 0] == pytest.approx(0.2, abs=1e-5)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ((HEADER.replace("joint4", "elbow"), *ROWS), "column joint4 is missing; there are time, "),
        ((HEADER,), "there are no rows below the names of the columns"),
        ((f"{HEADER},q_w,q_x,q_y,q_z", f"{ROWS[0]},0,0,0,0"), "must have a norm of 0.001"),
    ],
)
def test_wrong_files_are_named(tmp_path: Path, lines: tuple[str, ...], said: str) -> None:
    path = write(tmp_path / "my.csv", *lines)
    with pytest.raises(InputError, match=said) as error:
        mission_layer(path, "mission", "paper")
    assert str(path) in str(error.value)


def test_a_robot_without_file_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "my.csv", HEADER, *ROWS)
    with pytest.raises(InputError, match="robot with a file or name"):
        mission_layer(path, "mission", "given")


def layers(start: str) -> tuple[Tree, Tree]:
    """Return the parameters of plant and mission of a document with a start."""
    with TemporaryDirectory() as folder:
        text = f"mission: {{start: {{joints_deg: [0, 0], {start}}}, segments: [{{hold: 1}}]}}"
        path = write(Path(folder) / "my.yaml", text)
        plant, mission = (mission_layer(path, node, "paper") for node in ("plant", "mission"))
        return plant, mission


def test_a_start_may_have_a_rate_and_then_needs_no_attitude() -> None:
    plant, mission = layers("base: {rate_deg_s: [0, 0.5, -1]}")
    assert plant["initial_rate_deg_s"] == mission["base_rate_deg_s"] == [0.0, 0.5, -1.0]
    assert plant["initial_quaternion"] == mission["base_quaternion"] == [1.0, 0.0, 0.0, 0.0]
    plant, mission = layers("base: {rpy_deg: [0, 0, 180]}")
    assert not {"initial_rate_deg_s", "base_rate_deg_s"} & {*plant, *mission}
    assert abs(plant["initial_quaternion"][3]) == pytest.approx(1.0)


@pytest.mark.parametrize("base", ["nadir", "{point: nadir}"])
def test_the_attitude_of_a_start_that_points_follows_from_the_orbit(base: str) -> None:
    plant, mission = layers(f"base: {base}")
    assert set(plant) == {"initial_joints_deg"}
    assert json.loads(mission["base_point"]) == {"point": "nadir"}
    assert "base_quaternion" not in mission


@pytest.mark.parametrize(
    ("base", "said"),
    [
        ("{}", "start.base: give rpy_deg, quaternion, rate_deg_s, or point, got {}"),
        ("{rate_deg_s: [1, 2]}", r"start.base.rate_deg_s: List should have at least 3 items"),
        ("{rate_deg_s: [1, 2, 1e9]}", "less than or equal to 3600"),
        ("{rate: [1, 2, 3]}", r"start.base.rate: unknown key.*\(did you mean rate_deg_s\?\)"),
        ("{rpy_deg: [0, 0, 0], quaternion: [1, 0, 0, 0]}", "give one of them"),
    ],
)
def test_a_wrong_start_is_refused(base: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        layers(f"base: {base}")
