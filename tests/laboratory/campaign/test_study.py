"""A campaign's file: whatever is wrong with it is told in one line, with file and key."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import yaml
from paths import CONFIG

from space_robot.campaign.draws import Draws
from space_robot.campaign.flown.preparation import Preparation
from space_robot.campaign.study import Law, Requirement, Study, read_study, short_names
from space_robot_msgs_py.errors import InputError

MASS = "robot.links[*].mass"
GOOD: dict[str, Any] = {
    "scenario": {"duration": 0.1},
    "laws": ["ctc"],
    "require": {"pointing": {"metric": "attitude_max", "below": 1e-3, "in": 0.9}},
    "runs": 4,
}


def read(folder: Path, **keys: Any) -> Draws:
    file = folder / "my.yaml"
    file.write_text(yaml.safe_dump({**GOOD, **keys}))
    study = read_study(file)
    return Draws(study, seed=0, runs=study.runs_asked())


WRONG_FILES: list[tuple[dict[str, Any], str]] = [
    ({"lawes": ["ctc"]}, "lawes: unknown key"),
    ({"laws": []}, "laws: "),
    ({"laws": ["ctc", "ctc"]}, "laws: the same law twice"),
    ({"laws": ["ctc="]}, "laws: LAW or LAW=GAINS"),
    ({"laws": "ctc"}, "laws: "),
    ({"laws": ["pid"]}, "law pid: unknown"),
    ({"laws": ["ctc=lost"]}, "law ctc=lost: "),
    ({"scenario": {"cas": 3}}, "scenario: unknown option 'cas'"),
    ({"scenario": {"seed": 3}}, "scenario: seed cannot be set"),
    ({"scenario": {"controller": "ctc"}}, "scenario: controller cannot be set: use laws"),
    ({"scenario": {"realtime": True}}, "scenario: realtime cannot be set"),
    ({"scenario": {"case": "9"}}, "unknown case '9'"),
    ({"scenario": {"duration": "long"}}, "duration: "),
    ({"require": {"p": {"metric": "a", "below": 1, "in": 1.5}}}, "require.p.in: "),
    ({"require": {"p": {"metric": "a", "in": 0.9}}}, "require.p: either below or above"),
    ({"require": {"p": {"metric": "a", "below": 1, "above": 0, "in": 0.9}}}, "require.p: either"),
    ({"require": {"p": {"metrik": "a", "below": 1, "in": 0.9}}}, "require.p.metrik: unknown key"),
    ({"require": {"p": {"metric": "a", "below": 1, "in": 0.9, "from_s": 2, "to_s": 1}}}, "to_s"),
    ({"keep": {"bag": "sometimes"}}, "keep.bag: "),
    ({"until": {"half_width": 0.1}}, "until.runs: "),
    ({"until": {"half_width": 0.9, "runs": 5}}, "until.half_width: "),
    ({"until": {"half_width": 0.1, "runs": 5}, "require": {}}, "until: "),
    ({"until": {"half_width": 0.1, "runs": 5}, "design": "latin_hypercube"}, "design: "),
    ({"until": {"half_width": 0.1, "runs": 5}, "fixed_runs": True}, "fixed_runs: contradicts"),
    ({"design": "halton"}, "design: "),
    ({"runs": 0}, "runs: "),
    ({"runs": None}, "runs: missing"),
    ({"runs": 5, "vary": {"scenario.case": {"grid": [1, 3]}}}, "runs: a multiple of 2"),
    (
        {"runs": 4, "design": "saltelli", "vary": {MASS: {"normal": 20, "sigma": 1}}},
        "runs: a multiple of 8",
    ),
    ({"design": "saltelli", "vary": {"scenario.case": {"choice": [1, 3]}}}, "continuous"),
]
WRONG_VARIABLES: list[tuple[str, Any, str]] = [
    ("robot.links[*].mas", 1.0, "unknown number of robot.links[...] 'mas'"),
    ("robot.links[9].mass", 1.0, "no link '9': choose one of joint1"),
    ("robot.links.mass", 1.0, "an element is missing"),
    ("robot.legs[1].mass", 1.0, "unknown part of the robot 'legs'"),
    ("robot..mass", 1.0, "is not a variable name"),
    ("rocket.mass", 1.0, "unknown group 'rocket'"),
    ("robot.links[*].com", 0.1, "the axis is missing"),
    ("robot.joints[*].friction.coulomb", 0.1, "vary plant.friction.coulomb"),
    ("robot.joints[joint1].stiffness", 0.1, "has a motor and no spring"),
    (MASS, {"normal": 1.0}, "sigma: "),
    (MASS, {"normal": 1.0, "sigma": -1}, "sigma: "),
    (MASS, {"normal": 1.0, "sigma": float("nan")}, "sigma: "),
    (MASS, {"normal": 1, "sigma": 1, "low": 2, "high": 1}, "low must be below high"),
    (MASS, {"nornal": 1.0, "sigma": 1}, "a distribution was expected"),
    (MASS, [1, 2], "a distribution was expected"),
    (MASS, {"uniform": [2, 1]}, "uniform: a lower bound"),
    (MASS, {"uniform": [-1, 1]}, "can be -1: "),
    (MASS, {"log_uniform": [0, 1]}, "log_uniform: numbers above 0"),
    (MASS, {"uniform": [1, 2], "relative": True, "offset": True}, "relative and offset"),
    (MASS, {"choice": ["light", "heavy"]}, "numbers were expected"),
    (MASS, {"choice": [1, 2], "weights": [1]}, "weights: one weight"),
    ("robot.base.inertia", {"scale": 0.1, "rotat_deg": 3}, "rotat_deg: unknown key"),
    ("robot.base.inertia", {"uniform": [100, 200]}, "needs relative: true"),
    ("scenario.cse", {"choice": [1, 3]}, "unknown option 'cse'"),
    ("scenario.case", {"choice": [1, 9]}, "scenario.case can be 9: "),
    ("scenario.case", {"choice": [1, "4-1"]}, "numbers and texts are mixed: put the numbers in"),
    ("scenario.command_latency_ticks", {"uniform": [0, 2]}, "valid integer"),
    ("scenario.duration", {"uniform": [0.9, 1.1], "offset": True, "low": 1}, "low: unknown key"),
    ("plant.friction.columb", 0.1, "unknown parameter of the plant"),
    ("plant.friction.coulomb", {"normal": 0.02, "sigma": 0.005}, "plant.friction.coulomb can be -"),
    (
        "plant.initial_joints_deg",
        1.0,
        "is a list: plant.initial_joints_deg[*] for all of it, or plant.initial_joints_deg[1] to "
        "[6] for one of them",
    ),
    ("plant.fault_seed", {"uniform": [0, 1]}, "fault_seed"),
    ("plant.case", {"choice": ["1", "3"]}, "scenario.case"),
    ("gains.k_9", {"uniform": [0.9, 1.1], "relative": True}, "unknown gain 'k_9' of the laws"),
    ("faults", {"torque_skale@0:all": 1.0}, "unknown kind of fault"),
    ("faults", {"torque_scale@0": 1.0}, "the text up to its number"),
    ("faults", {"torque_scale@0:all": {"uniform": [-1, 1]}}, "can be -1: "),
    ("faults", {"torque_scale@0:all": {"uniform": [1, 2], "relative": True}}, "no nominal value"),
    ("faults", {"torque_scale@0:joint7": {"uniform": [1, 2]}}, "joint7"),
    ("faults", 3, "a mapping of faults was expected"),
]


def test_the_good_one_is_read(tmp_path: Path) -> None:
    assert read(tmp_path).names == []


@pytest.mark.parametrize(("keys", "told"), WRONG_FILES, ids=lambda value: str(value)[:40])
def test_a_wrong_file_is_told_in_a_line(tmp_path: Path, keys: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError) as raised:
        read(tmp_path, **keys)
    assert told in str(raised.value)
    assert str(raised.value).startswith(f"{tmp_path}/my.yaml: ")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(("key", "given", "told"), WRONG_VARIABLES, ids=lambda v: str(v)[:40])
def test_a_wrong_variable_is_told_in_a_line(
    tmp_path: Path, key: str, given: Any, told: str
) -> None:
    with pytest.raises(InputError) as raised:
        read(tmp_path, vary={key: given})
    assert told in str(raised.value)
    assert str(raised.value).startswith(f"{tmp_path}/my.yaml: vary.{key}")
    assert "\n" not in str(raised.value)


def test_nothing_is_varied_twice(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"robot.links\[joint1\].mass is varied by robot"):
        read(tmp_path, vary={MASS: 20.0, "robot.links[1].mass": 20.0})
    with pytest.raises(InputError, match="is part of an inertia that is varied as a whole"):
        read(
            tmp_path,
            vary={
                "robot.links[1].inertia": {"scale": 0.1},
                "robot.links[*].inertia": {"uniform": [0.9, 1.1], "relative": True},
            },
        )
    with pytest.raises(InputError, match="cannot be varied together"):
        read(tmp_path, vary={MASS: 20.0, "scenario.robot": {"choice": ["paper"]}})


def test_a_requirement_holds_strictly() -> None:
    below = Requirement.model_validate({"metric": "a", "below": 1.0, "in": 0.9})
    above = Requirement.model_validate({"metric": "a", "above": 1.0, "in": 0.9})
    assert [below.is_met(value) for value in (0.9, 1.0, float("nan"))] == [True, False, False]
    assert [above.is_met(value) for value in (1.1, 1.0, float("nan"))] == [True, False, False]
    assert below.confidence == 0.9


def test_what_was_read_reads_again() -> None:
    study = read_study("first")
    again = Study.model_validate_json(study.model_dump_json(by_alias=True))
    assert again.model_dump() == study.model_dump()
    assert Law.parse("tde_stc=robust") == ("tde_stc", "robust")
    assert Law.parse("tde_stc") == ("tde_stc", "default")


@pytest.mark.parametrize("file", sorted((CONFIG / "campaigns").iterdir()), ids=lambda f: f.stem)
def test_a_shipped_campaign_can_be_flown(file: Path) -> None:
    """Also at every point of its grid."""
    study = read_study(file.stem)
    assert Preparation.of(study, 0, None).manifest.runs == study.runs
    draws = Draws(study, 0, study.runs_asked())
    for run in range(math.prod(draws.grid.values())):
        draws.scenario(run, study.laws[0]).check()


def test_names_of_shipped_campaigns_are_told() -> None:
    with pytest.raises(InputError, match=r"unknown campaign 'frist': choose one of .*first"):
        read_study("frist")


def test_tables_leave_out_the_gain_set_that_all_laws_have() -> None:
    assert list(short_names(["ctc=robust", "tde_stc=robust"]).values()) == ["ctc", "tde_stc"]
    assert list(short_names(["ctc", "tde_stc"]).values()) == ["ctc", "tde_stc"]
    assert list(short_names(["ctc", "ctc=robust"]).values()) == ["ctc", "ctc=robust"]
