"""``space-robot new``: a robot's file becomes a folder that flies, or nothing at all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result
from paths import CONFIG, DATA

from space_robot.campaign.flown import Campaign
from space_robot.campaign.new_robot import robot_texts
from space_robot.campaign.new_robot.make import mission_text, rest_to_rest
from space_robot.cli.main import cli
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.guidance.mission import Mission
from space_robot_control.laws import laws
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import DivergedError, InputError, SpaceRobotError

FILE = str(CONFIG / "robots/ets_vii.yaml")
ARM = DATA / "arm.urdf"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def _shorter(file: str) -> str:
    """The same campaign with flights of a twentieth of a second."""
    content = yaml.safe_load(Path(file).read_text("utf-8"))
    content["scenario"]["duration"] = 0.05
    Path(file).write_text(yaml.safe_dump(content))
    return file


def new(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ["new", *arguments])


def test_a_file_becomes_a_folder_that_flies(tmp_path: Path) -> None:
    result = new(FILE, "--out", "mine", "--json")
    assert result.exit_code == 0, result.exception
    assert "made mine/: `space-robot fly --robot mine/` flies it" in result.stderr
    report = json.loads(result.stdout)
    assert list(report["laws"]) == sorted(laws())
    for law in report["laws"].values():
        assert law["rms"]["attitude"] < 1e-6
    assert [entry.name for entry in tmp_path.iterdir()] == ["mine"]
    log = simulate(Flight(resolve(FlightPlan(robot="mine", controller="ctc", duration=0.01))))
    assert log.flight["mission"] == "mine"
    assert (best := report["default_law"]) != "adrc"
    assert report["remarks"][0].startswith(f"{best} is flown unless another law is named")
    plain = CliRunner().invoke(cli, ["simulate", "--robot", "mine", "--duration", "0.01", "--json"])
    assert json.loads(plain.stdout)["controller"] == best
    assert resolve(FlightPlan(robot="mine")).law.name == best
    named = resolve(FlightPlan(robot="mine", controller="tde_stc"))
    assert named.law.name == "tde_stc"
    study = Campaign.load("mine/campaign.yaml").study
    assert study.scenario["robot"] == "mine/"
    flown = CliRunner().invoke(
        cli, ["campaign", "run", _shorter("mine/campaign.yaml"), "--runs", "2", "--workers", "0"]
    )
    assert flown.exit_code == 0, flown.exception
    assert "pointing" in flown.stdout
    assert (tmp_path / "campaigns/mine/table.parquet").is_file()
    assert isinstance(new(FILE, "--out", "mine").exception, InputError), "it is there"


def test_a_gain_set_names_shipped_laws_only(tmp_path: Path) -> None:
    """So that nobody's folder runs code before the user has named it."""
    own = tmp_path / "own"
    shutil.copytree(CONFIG / "gains/paper/tuned", own)
    text = "controller_node:\n  ros__parameters:\n    controller: "
    (own / "controller.yaml").write_text(f"{text}pd\n")
    assert resolve(FlightPlan(gains=f"{own}/")).law.name == "pd"
    (own / "controller.yaml").write_text(f"{text}evil.py:Law\n")
    with pytest.raises(InputError, match=r"unknown controller 'evil.py:Law' of controller.yaml"):
        resolve(FlightPlan(gains=f"{own}/"))
    assert resolve(FlightPlan(gains=f"{own}/", controller="ctc")).law.name == "ctc"


def test_a_law_that_cannot_fly_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def blocks(flight: Flight) -> Iterator[FlightLog]:
        if flight.controller.law.name == "tde_smc":
            raise DivergedError(7, 0.0005, "too fast")
        yield simulate(Flight(resolve(FlightPlan(robot=FILE, duration=0.01))))

    monkeypatch.setattr("space_robot.campaign.new_robot.make.fly_blocks", blocks)
    result = new(FILE)
    assert isinstance(result.exception, SpaceRobotError)
    assert "tde_smc: the flight diverged at tick 7" in str(result.exception)
    assert result.exception.exit_code == 1
    assert "ended" in result.stdout
    assert Path("ets_vii/gains/tuned/tde_smc.yaml").is_file()


def test_what_was_there_is_replaced_if_told_so_and_kept_if_anything_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(flight: Flight) -> Iterator[FlightLog]:
        raise KeyboardInterrupt

    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "robot.yaml").write_text("old")
    monkeypatch.setattr("space_robot.campaign.new_robot.make.fly_blocks", fail)
    CliRunner().invoke(cli, ["new", FILE, "--out", "mine", "--force"])
    assert (mine / "robot.yaml").read_text() == "old"
    assert list(tmp_path.iterdir()) == [mine]
    (mine / "thesis.tex").touch()
    result = new(FILE, "--out", "mine", "--force")
    assert "also contains 'thesis.tex': it is not replaced" in str(result.exception)


def test_a_urdf_stays_one_and_has_a_mission_within_its_limits() -> None:
    texts, robot = robot_texts(ARM, "hull", False, "a command")
    assert list(texts) == ["robot.yaml", "arm.urdf"]
    assert yaml.safe_load(texts["robot.yaml"]) == {"robot": {"urdf": "arm.urdf", "base": "hull"}}
    for name, text in texts.items():
        Path(name).write_text(text)
    read = find_robot("./")
    assert np.array_equal(read.offset, robot.offset)
    assert len(read.visuals) == len(Robot.from_urdf(ARM).visuals)

    mission = rest_to_rest(robot)
    written = yaml.safe_load(mission_text(robot, mission, "a command"))["mission_node"]
    assert written["ros__parameters"]["waypoints_deg"] == mission.waypoints_deg
    chunk = Mission(robot, mission, 0.05).chunk(0, int(mission.waypoint_times[-1] / 0.05) + 1)
    positions, velocities, _ = np.moveaxis(chunk.joints, 1, 0)
    for joint, limit in enumerate(robot.limits):
        assert limit.lower <= positions[:, joint].min() < positions[:, joint].max() <= limit.upper
        assert np.abs(velocities[:, joint]).max() <= 0.51 * limit.velocity
    assert mission.waypoint_times[1] > 10.0, "its joints are slow"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["none.urdf"], "none.urdf: no such file"),
        ([FILE, "--base", "hull"], "not a URDF, so base and repair"),
        ([str(ARM), "--base", "leg"], "leg"),
        ([FILE, "--out", "/proc/mine"], "/proc/mine: cannot be written"),
    ],
)
def test_what_cannot_be_is_said_and_leaves_nothing(
    arguments: list[str], said: str, tmp_path: Path
) -> None:
    result = new(*arguments)
    assert isinstance(result.exception, InputError)
    assert said in str(result.exception)
    assert result.exception.exit_code == 2
    assert not list(tmp_path.iterdir())
