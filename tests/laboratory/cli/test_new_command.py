"""``space-robot new``: a folder that flies from a robot's file; templates, and their tests."""

from __future__ import annotations

import json
import math
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result
from paths import CONFIG, DATA, ROOT

from space_robot.choice import ChoiceOptions
from space_robot.choice.new_robot import (
    BASE_TORQUE,
    DAMPING_RATIO,
    FREQUENCY_HZ,
    check_replaceable,
    hinge_remark,
    mission_text,
    rest_to_rest,
    tool_remark,
)
from space_robot.choice.robot_files import robot_texts
from space_robot.cli.main import cli
from space_robot.cli.new import new as new_command
from space_robot.cli.new_files import LAW, METRIC, MISSION, SENSOR
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.tuning.estimate_design import EstimateDesign
from space_robot.tuning.gain_file import estimate_remark
from space_robot.tuning.law_gains import TunedLaw
from space_robot.tuning.method import Tuned
from space_robot.tuning.task import CONSTANT, TuningOptions, force_demand
from space_robot_control.guidance.mission import Mission
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.environment import EnvironmentSettings

FILE = str(CONFIG / "robots/ets_vii.yaml")
ARM = DATA / "arm.urdf"
FEW = ("--evaluations", "1", "--runs", "2", "--workers", "0")
KINDS = {kind.name: kind for kind in (LAW, SENSOR, METRIC, MISSION)}


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, arguments)


def new(*arguments: str) -> Result:
    return run("new", *arguments)


def quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `new` choose by short trials, with the gains from which a search would start."""
    short = ChoiceOptions(evaluations=1, trial_s=1.0, runs=2, ripple=10.0)
    monkeypatch.setattr("space_robot.choice.new_robot.SHORT", short)


def test_choose_sets_the_law_of_ones_own_robot_and_of_no_shipped_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    quickly(monkeypatch)
    made = new(str(ARM), "--out", "mine", "--law", "ctc", *FEW)
    assert made.exit_code == 0, made.exception
    words = ("--law", "pd", *FEW, "--duration", "1.1", "--ripple", "10")
    own = run("choose", "mine/robot.yaml", *words)
    assert "mine/robot.yaml flies pd with gains mine/gains/chosen from now on" in own.stderr
    assert resolve(Scenario(robot="mine/")).law.name == "pd"
    check_replaceable(Path("mine"), force=True, files=["robot.yaml", ARM.name])
    Path("paper.yaml").write_text((CONFIG / "robots/paper.yaml").read_text("utf-8"), "utf-8")
    assert "to fly it: --controller pd" in run("choose", "./paper.yaml", *words).stderr
    assert not (CONFIG / "gains/paper/chosen").exists()


def test_a_file_becomes_a_folder_that_flies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    quickly(monkeypatch)
    result = new(FILE, "--out", "mine", "--law", "ctc", "--law", "pd", *FEW, "--json")
    assert result.exit_code == 0, result.exception
    assert "made mine/: `space-robot fly --robot mine/` flies it" in result.stderr
    report = json.loads(result.stdout)
    assert list(report["laws"]) == ["ctc", "pd"]
    assert [entry.name for entry in tmp_path.iterdir()] == ["mine"]
    assert (best := report["default_law"]) == "ctc"
    assert f"Fly {best}: of 2 laws within the limits it has the least" in report["remarks"][0]
    plain = json.loads(run("simulate", "--robot", "mine", "--duration", "0.01", "--json").stdout)
    assert plain["controller"] == best
    assert Flight(resolve(Scenario(robot="mine"))).description["mission"] == "mine"
    named = resolve(Scenario(robot="mine", controller="pd"))
    assert named.law.name == "pd"
    file = tmp_path / "mine/campaign.yaml"
    content = yaml.safe_load(file.read_text("utf-8"))
    assert content["scenario"]["robot"] == "mine/"
    content["scenario"]["duration"] = 0.05
    file.write_text(yaml.safe_dump(content))
    flown = run("campaign", "run", "mine/campaign.yaml", "--runs", "2", "--workers", "0")
    assert flown.exit_code == 0, flown.exception
    assert (tmp_path / "campaigns/mine/campaign.sqlite").is_file()
    assert isinstance(new(FILE, "--out", "mine").exception, InputError), "it is there"


def test_a_gain_set_names_shipped_laws_only(tmp_path: Path) -> None:
    """So that nobody's folder runs code before the user has named it."""
    own = tmp_path / "own"
    shutil.copytree(CONFIG / "gains/paper/tuned", own)
    text = "controller_node:\n  ros__parameters:\n    controller: "
    (own / "controller.yaml").write_text(f"{text}pd\n")
    assert resolve(Scenario(gains=f"{own}/")).law.name == "pd"
    (own / "controller.yaml").write_text(f"{text}evil.py:Law\n")
    with pytest.raises(InputError, match=r"unknown controller 'evil.py:Law' of controller.yaml"):
        resolve(Scenario(gains=f"{own}/"))
    assert resolve(Scenario(gains=f"{own}/", controller="ctc")).law.name == "ctc"


def test_what_was_there_is_replaced_if_told_so_and_kept_if_anything_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "robot.yaml").write_text("old")
    monkeypatch.setattr("space_robot.choice.new_robot.recommend", fail)
    new(FILE, "--out", "mine", "--force")
    assert (mine / "robot.yaml").read_text() == "old"
    assert list(tmp_path.iterdir()) == [mine]
    (mine / "thesis.tex").touch()
    result = new(FILE, "--out", "mine", "--force")
    assert "also contains 'thesis.tex': it is not replaced" in str(result.exception)


def test_a_mission_asks_no_more_of_the_base_than_usual_wheels_give() -> None:
    robot = find_robot("seven_joint")
    mission = rest_to_rest(robot)
    asked = force_demand(robot, mission, [EnvironmentSettings()]).nominal
    usual = 0.5 * BASE_TORQUE * sum(robot.mass)
    assert 0.8 * usual < max(asked[:3]) < 1.05 * usual


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
    written = yaml.safe_load(mission_text(robot, mission, "a command"))["mission"]
    assert written["start"]["joints_deg"] == mission.joints_deg
    assert written["segments"] == [yaml.safe_load(text) for text in mission.segments]
    planned = Mission(robot, mission, 0.05)
    chunk = planned.chunk(0, int(planned.duration / 0.05) + 1)
    positions, velocities, _ = np.moveaxis(chunk.joints, 1, 0)
    for joint, limit in enumerate(robot.limits):
        assert limit.lower <= positions[:, joint].min() < positions[:, joint].max() <= limit.upper
        assert np.abs(velocities[:, joint]).max() <= 0.51 * limit.velocity
    assert planned.pieces[0].end > 10.0, "its joints are slow"


def test_a_joint_is_made_passive_in_one_step(tmp_path: Path) -> None:
    """`--passive` of a URDF, with its meshes wherever the folder is; of a YAML, too."""
    folder = tmp_path / "cad"
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "fore.stl").touch()
    named = ARM.read_text("utf-8").replace("package://arm/fore.stl", "meshes/fore.stl")
    (folder / "arm.urdf").write_text(named)
    springs = {"slide": {"stiffness": 15.0, "damping": 0.05}}
    texts, robot = robot_texts(folder / "arm.urdf", None, False, "a command", springs)
    assert (robot.joint_names, robot.passive_names) == (("shoulder",), ("slide",))
    assert yaml.safe_load(texts["robot.yaml"])["robot"] == {"urdf": "arm.urdf", "passive": springs}
    mine = tmp_path / "mine"
    mine.mkdir()
    for name, text in texts.items():
        (mine / name).write_text(text)
    read = find_robot("mine/")
    assert read.springs == robot.springs
    assert read.visuals
    meshes = {shape.mesh for shape in read.visuals if shape.shape == "mesh"}
    assert str(folder / "meshes" / "fore.stl") in meshes
    _, robot = robot_texts(Path(FILE), None, False, "a command", {"joint3": springs["slide"]})
    assert robot.passive_names == ("joint3",)


def test_a_yaml_keeps_its_urdf() -> None:
    """With all that it adds to it; shapes stay those of the URDF."""
    Path("mine").mkdir()
    added = {"passive": {"slide": {"stiffness": 15.0, "damping": 0.05}}, "tools": ["fore"]}
    content = {"robot": {"urdf": str(ARM), "base": "hull", **added}}
    Path("mine/robot.yaml").write_text(yaml.safe_dump(content))
    texts, _ = robot_texts(Path("mine/robot.yaml"), None, False, "a command")
    kept = {"urdf": "arm.urdf", "base": "hull", **added}
    assert yaml.safe_load(texts["robot.yaml"])["robot"] == kept
    assert list(texts) == ["robot.yaml", "arm.urdf"]
    for name, text in texts.items():
        Path("mine", name).write_text(text)
    read = find_robot("mine/")
    assert read.passive_names == ("slide",)
    assert len(read.visuals) == len(Robot.from_urdf(ARM).visuals)


@pytest.mark.parametrize("stale", ["mission", "gains"])
def test_files_for_other_joints_name_the_command_that_mends_them(stale: str) -> None:
    """A joint made passive by hand leaves mission and gains with a value too many."""
    texts, robot = robot_texts(ARM, None, False, "a command")
    Path("mine/gains/tuned").mkdir(parents=True)
    count = {"mission": 4, "gains": 5}[stale]
    gains = {"k_p": [1e4] * count, "k_d": [200.0] * count}
    gains_file = {"controller_node": {"ros__parameters": {"ctc": gains}}}
    Path("mine/gains/tuned/ctc.yaml").write_text(yaml.safe_dump(gains_file))
    Path("mine/gains/default_sets.yaml").write_text("ctc: tuned\n")
    text = mission_text(robot, rest_to_rest(robot), "a command")
    Path("mine/mission.yaml").write_text(text)
    for name, text in texts.items():
        Path("mine", name).write_text(text)
    with Path("mine/robot.yaml").open("a") as file:
        file.write("  passive: {slide: {stiffness: 15.0, damping: 0.05}}\n")
    with pytest.raises(InputError) as caught:
        resolve(Scenario(robot="mine", controller="ctc"))
    command = "`space-robot new mine/ --out mine --force` makes mission and gains anew"
    assert command in str(caught.value)
    said = {"mission": "mine/mission.yaml: the start has", "gains": "were expected, got 5: ["}
    assert said[stale] in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "out"),
    [
        ("law", ""),
        ("law", "my pieces/deep"),
        ("sensor", "deep"),
        ("metric", ""),
        ("mission", "deep"),
    ],
)
def test_the_printed_command_flies_the_file(kind: str, out: str, tmp_path: Path) -> None:
    result = new(kind, "mine_2", *(["--out", out] if out else []))
    assert result.exit_code == 0, result.exception
    files = sorted(path.name for path in (tmp_path / out).iterdir())
    assert files == sorted(name.replace("$name", "mine_2") for name in KINDS[kind].files.values())
    for command in result.stdout.splitlines():
        _, *words = shlex.split(command)
        short = ["--duration", "0.2"] if words[0] == "simulate" else []
        flown = run(*words, *short, "--json")
        assert flown.exit_code == 0, (flown.output, flown.exception)
    report = json.loads(flown.stdout)
    assert report["metrics"]["joints_1_3.rms"] < 1e-4
    if kind == "metric":
        assert 0.0 < report["metrics"]["mine_2"] < 0.01


@pytest.mark.docs
def test_their_tests_pass(tmp_path: Path) -> None:
    """As their user would run them."""
    for kind in KINDS:
        assert new(kind, f"my_{kind}").exit_code == 0
    result = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout
    assert "8 passed" in result.stdout


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    there = tmp_path / "test_mine.py"
    there.write_text("mine", "utf-8")
    for kind in KINDS:
        result = new(kind, "mine")
        assert isinstance(result.exception, InputError)
        assert "test_mine.py: exists already; it is not overwritten" in str(result.exception)
        assert [path.name for path in tmp_path.iterdir()] == ["test_mine.py"]
    assert there.read_text("utf-8") == "mine"


LINK = """<link name="{0}"><inertial><origin xyz="{1} 0 0"/><mass value="{2}"/>
<inertia ixx="0.1" iyy="0.2" izz="{3}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""

JOINT = """<joint name="{0}" type="{3}"><parent link="{1}"/><child link="{2}"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="9" velocity="1"/></joint>"""


def satellite(tmp_path: Path, panel: str = "revolute") -> Robot:
    """A base with an arm of two joints between two panels, each 3 kg at 0.5 m of its hinge."""
    links = [("bus", 0, 100, 0.25), ("upper", 0.2, 5, 0.25), ("fore", 0.2, 5, 0.25)]
    links += [("left", 0.5, 3, 0.25), ("right", 0.5, 3, 0.25)]
    joints = [
        ("left_hinge", "bus", "left", panel),
        ("a", "bus", "upper", "revolute"),
        ("b", "upper", "fore", "revolute"),
        ("right_hinge", "bus", "right", panel),
    ]
    text = "".join(LINK.format(*x) for x in links) + "".join(JOINT.format(*x) for x in joints)
    file = tmp_path / "satellite.urdf"
    file.write_text(f'<robot name="satellite">{text}</robot>')
    return Robot.from_urdf(file)


def test_panels_on_hinges_are_proposed_as_passive_joints(tmp_path: Path) -> None:
    """The command is one that `new` takes, and its springs swing as they are said to."""
    robot = satellite(tmp_path)
    remark = hinge_remark(robot, f"space-robot new {tmp_path}/satellite.urdf", Path("my sat"))
    words = shlex.split(remark.split("`")[1])
    assert words[:2] == ["space-robot", "new"]
    parsed = new_command.commands["robot"].make_context("robot", words[2:]).params
    assert (parsed["out"], parsed["force"]) == (Path("my sat"), True)
    proposed = parsed["passive"]
    assert list(proposed) == ["left_hinge", "right_hinge"]
    _, passive = robot_texts(Path(parsed["robot"]), None, False, "", proposed)
    assert (passive.joint_names, set(passive.passive_names)) == (("a", "b"), set(proposed))
    inertia = 0.25 + 3.0 * 0.5**2  # about the hinge
    for spring in proposed.values():
        rate = math.sqrt(spring["stiffness"] / inertia)
        assert rate / (2.0 * math.pi) == pytest.approx(FREQUENCY_HZ, rel=0.03)
        ratio = spring["damping"] / (2.0 * inertia * rate)
        assert ratio == pytest.approx(DAMPING_RATIO, rel=0.05)
    assert hinge_remark(passive, "", tmp_path) == ""
    assert remark.startswith("left_hinge, right_hinge: each carries one body")


@pytest.mark.parametrize(("slower", "is_told"), [(1.01, False), (9.9, False), (10.1, True)])
def test_weak_gains_are_told_with_their_reason(slower: float, is_told: bool) -> None:
    ones, laws = np.ones(9), {"ctc": TunedLaw({}, 5.0 * slower)}
    design = EstimateDesign(CONSTANT, ones, 0.06, 120.0, 1.0, 0.0123, 5.0, 5.0, ones, ones)
    tuned = Tuned(TuningOptions(0.05, 0.2), design, design, 1.0, laws)
    remark = estimate_remark(tuned)
    assert bool(remark) == is_told
    if is_told:
        assert all(number in remark for number in ("0.06 to 120", "12.3 ms", "5 rad/s"))


def test_the_frame_that_missions_move_is_told_where_a_body_is_fixed_to_it(tmp_path: Path) -> None:
    camera = LINK.format("camera", 0.1, 1, 0.25) + JOINT.format("mount", "fore", "camera", "fixed")
    satellite(tmp_path)
    file = tmp_path / "satellite.urdf"
    for more, tools, told in (
        (camera, "", True),
        (camera, "tools: [camera]", False),
        ("", "", False),
    ):
        text = file.read_text().replace(camera, "").replace("</robot>", f"{more}</robot>")
        file.write_text(text)
        (tmp_path / "robot.yaml").write_text(f"robot:\n  urdf: satellite.urdf\n  {tools}\n")
        remark = tool_remark(Robot.from_yaml(tmp_path / "robot.yaml"), tmp_path)
        assert remark.startswith("Missions move the frame of fore, to which camera is") == told
        assert bool(remark) == told
