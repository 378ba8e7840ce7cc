"""A campaign's file, the shipped ones, and what `new` says of a robot."""

from __future__ import annotations

import math
import shlex
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG

from space_robot.analysis.metrics import axis_groups
from space_robot.campaign.draws import Draws
from space_robot.campaign.flown.preparation import Preparation
from space_robot.campaign.new_robot import robot_texts
from space_robot.campaign.new_robot.make import (
    BEYOND,
    DAMPING_RATIO,
    DIVERGED,
    FREQUENCY_HZ,
    Outcome,
    hinge_remark,
    tool_remark,
    trial_remark,
)
from space_robot.campaign.study import Requirement, read_study, short_names
from space_robot.cli.new import new
from space_robot.tuning.method import Tuned
from space_robot.tuning.task import TuningOptions
from space_robot.tuning.warning import estimate_remark
from space_robot_model.robot import Robot


def test_a_requirement_holds_strictly() -> None:
    below = Requirement.model_validate({"metric": "a", "below": 1.0, "in": 0.9})
    above = Requirement.model_validate({"metric": "a", "above": 1.0, "in": 0.9})
    assert [below.is_met(value) for value in (0.9, 1.0, float("nan"))] == [True, False, False]
    assert [above.is_met(value) for value in (1.1, 1.0, float("nan"))] == [True, False, False]
    assert below.confidence == 0.9


@pytest.mark.parametrize("file", sorted((CONFIG / "campaigns").iterdir()), ids=lambda f: f.stem)
def test_a_shipped_campaign_can_be_flown(file: Path) -> None:
    """Also at every point of its grid."""
    study = read_study(file.stem)
    assert Preparation.of(study, 0, None).manifest.runs == study.runs
    draws = Draws(study, 0, study.runs_asked())
    for run in range(math.prod(draws.grid.values())):
        draws.scenario(run, study.laws[0]).check()


def test_tables_leave_out_the_gain_set_that_all_laws_have() -> None:
    assert list(short_names(["ctc=robust", "tde_stc=robust"]).values()) == ["ctc", "tde_stc"]
    assert list(short_names(["ctc", "tde_stc"]).values()) == ["ctc", "tde_stc"]
    assert list(short_names(["ctc", "ctc=robust"]).values()) == ["ctc", "ctc=robust"]


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
    parsed = new.commands["robot"].make_context("robot", words[2:]).params
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
    one = {"left_hinge": proposed["left_hinge"]}
    _, passive = robot_texts(Path(parsed["robot"]), None, False, "", one)
    assert hinge_remark(passive, "", tmp_path).startswith("right_hinge: it carries one body")


@given(st.lists(st.integers(1, 9), min_size=2, max_size=6))
def test_joints_are_grouped_by_branch(branches: list[int]) -> None:
    """Each group has the joints of one branch, and its name tells their numbers."""
    n = sum(branches)
    groups = axis_groups(n, True, (), branches)
    axes = [np.arange(n + 3)[index].tolist() for index in groups.values()]
    assert [axis for group in axes for axis in group] == list(range(n + 3))
    assert [len(group) for group in axes] == [3, *branches]
    for name, group in list(zip(groups, axes, strict=True))[1:]:
        first, last = group[0] - 2, group[-1] - 2
        assert name == (f"{first}_{last}" if last > first else f"{first}")
    assert all(before[-1] + 1 == after[0] for before, after in pairwise(axes))
    assert list(axis_groups(n)) == ["base", f"1_{min(n, 3)}", *([f"4_{n}"] if n > 3 else [])]


@pytest.mark.parametrize(("slower", "is_told"), [(1.01, False), (9.9, False), (10.1, True)])
def test_weak_gains_are_told_with_their_reason(slower: float, is_told: bool) -> None:
    tuned = Tuned(
        TuningOptions(0.05, 0.2), 1.0, 0.0123, 5.0, 5.0 * slower, 0.06, 120.0, np.ones(9), {}
    )
    remark = estimate_remark(tuned)
    assert bool(remark) == is_told
    if is_told:
        assert all(number in remark for number in ("0.06 to 120", "12.3 ms", "5 rad/s"))


def test_laws_that_failed_in_the_comparison_are_named() -> None:
    flights = {
        law: Outcome({"attitude": 1.0}, "", 1.0, how)
        for law, how in (("a", DIVERGED), ("b", ""), ("c", BEYOND), ("d", DIVERGED))
    }
    remark = trial_remark(flights)
    assert remark.startswith("With friction, payload and disturbances of case 3, ")
    assert remark.endswith(": a, d diverged; c went beyond the joints' limits of effort.")
    assert trial_remark({"b": flights["b"]}) == ""


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
