"""A robot by its name or its files; its mission and gains; a trajectory or a start in a file."""

from __future__ import annotations

import json
import math
import re
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG, DATA

from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot_control.controller.settings import ControllerNodeSettings, gain_files, set_file
from space_robot_control.laws import laws
from space_robot_model.robot.find import (
    RobotChoice,
    find_robot,
    mission_layers,
    new_command,
    robot_as_path,
    robot_files,
    robot_names,
    split_choice,
    with_choice,
)
from space_robot_model.robot.mission_document import mission_layer
from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.errors import InputError

ARM = str(DATA / "arm.urdf")
LINKS = st.one_of(st.none(), st.text(min_size=1).filter(lambda text: text.isprintable()))


@given(
    name=st.sampled_from(["my.urdf", "a b/c?d.urdf", "what?.xacro", "mine/", "x?base=.urdf"]),
    base=LINKS,
    repair=st.booleans(),
)
def test_it_is_taken_apart_again(name: str, base: str | None, repair: bool) -> None:
    assert split_choice(with_choice(name, base, repair)) == RobotChoice(name, base, repair)


@given(st.text())
def test_any_text_is_a_name(text: str) -> None:
    assert text.startswith(split_choice(text).name)


@pytest.mark.parametrize(
    ("name", "base"), [(ARM, "hull"), (f"{ARM}?base=fore", "fore"), (f"{ARM}?repair", "hull")]
)
def test_a_robot_is_found_by_it(name: str, base: str) -> None:
    assert find_robot(name).mass[0] == {"hull": 300.0, "fore": 10.0}[base]
    assert robot_files(name).name == "arm"
    assert robot_as_path(name) == name


def test_what_makes_a_mission() -> None:
    assert new_command(f"{ARM}?base=fore&repair").endswith("arm.urdf --base fore --repair")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the seven-joint robot as a folder of its own."""
    own = tmp_path / "mine"
    own.mkdir()
    shutil.copy(CONFIG / "robots/seven_joint.yaml", own / "robot.yaml")
    shutil.copy(CONFIG / "missions/seven_joint.yaml", own / "mission.yaml")
    shutil.copytree(CONFIG / "gains/seven_joint", own / "gains")
    return own


def test_a_shipped_robot_has_all() -> None:
    assert {"paper", "seven_joint"} <= set(robot_names())
    found = robot_files("paper")
    assert found.name == "paper"
    assert found.mission == CONFIG / "missions/paper.yaml"
    assert found.gains == CONFIG / "gains/paper"
    assert find_robot("paper").name == "paper"


@pytest.mark.parametrize("name", ["mine/", "mine/robot.yaml"])
def test_a_folder_is_a_robot(folder: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder.parent)
    found = robot_files(name)
    assert found.name == "mine"
    assert mission_layers(name, "")[0].samefile(folder / "mission.yaml")
    assert gain_files(name, "default")["ctc"].samefile(folder / "gains/tuned/ctc.yaml")
    assert Flight(resolve(Scenario(robot=name, duration=0.1))).description["mission"] == "mine"


def test_a_folder_is_known_by_its_bare_name_on_the_command_line_alone(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder.parent)
    assert robot_as_path("mine") == "mine/"
    assert Flight(resolve(Scenario(robot="mine", duration=0.1))).robot.n == 7
    with pytest.raises(InputError, match=r"unknown robot 'mine': choose one of .*paper"):
        find_robot("mine")
    (folder.parent / "paper").mkdir()
    assert robot_as_path("paper") == "paper", "a shipped one comes first"


def test_what_is_not_there_is_said_in_one_line(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(folder / "robot.yaml", tmp_path / "arm.yaml")
    with pytest.raises(InputError, match=r"no mission of its own: `space-robot new .*arm.yaml`"):
        Flight(resolve(Scenario(robot=str(tmp_path / "arm.yaml"))))
    with pytest.raises(InputError, match=r"no gains of its own: `space-robot new .*arm.yaml`"):
        gain_files(str(tmp_path / "arm.yaml"), "default")
    with pytest.raises(InputError, match=r"no such file or folder"):
        find_robot(f"{tmp_path}/none/")
    (tmp_path / "passwd").write_text("root:x:0:0:")
    with pytest.raises(InputError, match=r"not a robot's file, its suffix must be one of \.yaml"):
        find_robot(f"{tmp_path}/passwd")
    monkeypatch.chdir(tmp_path)
    assert robot_as_path("passwd") == "./passwd", "so that it is not an unknown name"
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"no robot in this folder \(robot.yaml, robot.yml, "):
        find_robot(f"{tmp_path}/empty")


def test_the_low_pass_of_the_only_default_set_is_flown(folder: Path) -> None:
    shutil.copy(folder / "gains/robust/controller.yaml", folder / "gains/tuned")
    assert set_file(f"{folder}/", "default") == [folder / "gains/tuned/controller.yaml"]
    settings = ControllerNodeSettings.resolve({"robot": f"{folder}/"})
    assert settings.acceleration_filter_hz == 28.4
    assert set_file("paper", "default") == [], "its laws have sets of their own"


def test_gains_need_no_sets(folder: Path) -> None:
    shutil.copytree(folder / "gains/robust", folder / "flat")
    shutil.rmtree(folder / "gains")
    (folder / "flat").rename(folder / "gains")
    assert set(gain_files(f"{folder}/", "default")) == set(laws())
    assert set_file(f"{folder}/", "default") == [folder / "gains/controller.yaml"]


REFUSALS = yaml.safe_load((DATA / "refusals/robots.yaml").read_text("utf-8"))
HEADER = "time,joint1,joint2,joint3,joint4,joint5,joint6"
ROWS = ("0,0.1,2.0,3.8,0.0,-0.2,0.0", "1,0.15,2.0,3.8,0.0,-0.2,0.0", "2,0.2,2.0,3.8,0.0,-0.2,0.0")


def written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def test_it_starts_at_the_first_row(tmp_path: Path) -> None:
    path = written(tmp_path / "my.csv", HEADER, *ROWS)
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
    path = written(
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


@pytest.mark.parametrize(("lines", "said"), REFUSALS["trajectories"])
def test_wrong_files_are_named(tmp_path: Path, lines: list[str], said: str) -> None:
    path = written(tmp_path / "my.csv", *lines)
    with pytest.raises(InputError, match=said) as error:
        mission_layer(path, "mission", "paper")
    assert str(path) in str(error.value)


def test_a_robot_without_file_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "my.csv", HEADER, *ROWS)
    with pytest.raises(InputError, match="robot with a file or name"):
        mission_layer(path, "mission", "given")


def layers(start: str) -> tuple[Tree, Tree]:
    """Return the parameters of plant and mission of a document with a start."""
    with TemporaryDirectory() as folder:
        text = f"mission: {{start: {{joints_deg: [0, 0], {start}}}, segments: [{{hold: 1}}]}}"
        path = written(Path(folder) / "my.yaml", text)
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


@pytest.mark.parametrize(("base", "said"), REFUSALS["starts"])
def test_a_wrong_start_is_refused(base: str, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        layers(f"base: {base}")
