"""A robot by its name or its files, and where its mission and its gains are."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from paths import CONFIG

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_control.controller.gains import gain_files
from space_robot_control.controller.settings import ControllerNodeSettings, set_file
from space_robot_control.laws import laws
from space_robot_model.robot.find import (
    find_robot,
    mission_file,
    robot_as_path,
    robot_files,
    robot_names,
)
from space_robot_msgs_py.errors import InputError


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
    assert mission_file(name).samefile(folder / "mission.yaml")
    assert gain_files(name, "default")["ctc"].samefile(folder / "gains/tuned/ctc.yaml")
    assert Flight(resolve(FlightPlan(robot=name, duration=0.1))).description["mission"] == "mine"


def test_a_folder_is_known_by_its_bare_name_on_the_command_line_alone(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder.parent)
    assert robot_as_path("mine") == "mine/"
    assert Flight(resolve(FlightPlan(robot="mine", duration=0.1))).robot.n == 7
    with pytest.raises(InputError, match=r"unknown robot 'mine': choose one of .*paper"):
        find_robot("mine")
    (folder.parent / "paper").mkdir()
    assert robot_as_path("paper") == "paper", "a shipped one comes first"


def test_the_description_tells_all_of_a_robot_that_is_not_shipped(folder: Path) -> None:
    said = Flight(resolve(FlightPlan(robot=str(folder), duration=0.1))).description
    assert said["robot_file"]["robot"]["base"]["mass"] == 420.0
    assert said["parameters"]["plant"]["initial_joints_deg"][1] == 30.0
    assert said["parameters"]["mission"]["waypoint_times"] == [0.0, 12.0, 30.0]


def test_what_is_not_there_is_said_in_one_line(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(folder / "robot.yaml", tmp_path / "arm.yaml")
    with pytest.raises(InputError, match=r"no mission of its own: `space-robot new .*arm.yaml`"):
        Flight(resolve(FlightPlan(robot=str(tmp_path / "arm.yaml"))))
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
