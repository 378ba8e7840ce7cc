"""Thirty and more typing errors of users: the line that is said to each, and exit code 2."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import NamedTuple

import pytest
from command import Run
from flights import space_robot as started
from paths import CONFIG, DATA

URDF = (DATA / "docs.urdf").read_text("utf-8")
PAPER = (CONFIG / "robots/paper.yaml").read_text("utf-8")
START = "mission:\n  start: {joints_deg: [0, 90, 200, 20, 30, 10]}\n  segments: "
CAMPAIGN = """scenario: {case: "3", duration: 0.5}
laws: [tde_stc, ctc]
vary: {"plant.echo_scale[*]": {uniform: [0.99, 1.01]}}
require: {pointing: {metric: attitude_max, below: 1.0e-3, in: 0.9, confidence: 0.9}}
runs: 20
"""
FILES = {
    "my.urdf": URDF,
    "no_mass.urdf": URDF.replace('<mass value="10"/>', '<mass value="-10"/>'),
    "no_link.urdf": URDF.replace('<parent link="upper_arm"/>', '<parent link="uper_arm"/>'),
    "no_end.urdf": URDF.replace("</robot>", ""),
    "kg.yaml": re.sub(r"mass: ([\d.]+)", r"mass: \1 kg", PAPER, count=1),
    "scenario.yaml": "contoller: ctc\n",
    "seconds.yaml": "duration: 10 s\n",
    "tab.yaml": "duration: 5\n\tcase: 3\n",
    "segmets.yaml": START.replace("segments", "segmets") + "[{hold: 2}]\n",
    "joint_deg.yaml": START + "[{joint_deg: [0, 90, 200, 20, 30, 10], duration: 5}]\n",
    "five_joints.yaml": START.replace(", 10]", "]") + "[{hold: 2}]\n",
    "from_file.yaml": START + "[{file: track.csv}]\n",
    "no_file.yaml": START + "[{file: trak.csv}]\n",
    "track.csv": "time,joint1,joint2,joint3,joint4,joint5,joint_6\n0,0,0,0,0,0,0\n1,0,0,0,0,0,0\n",
    "scle.yaml": CAMPAIGN.replace("echo_scale", "echo_scle"),
    "unifrm.yaml": CAMPAIGN.replace("uniform", "unifrm"),
    "metric.yaml": CAMPAIGN.replace("attitude_max", "atitude_max"),
    "law.yaml": CAMPAIGN.replace("laws", "law"),
    "gains/tde_stc.yaml": "controller_node: {ros__parameters: {tde_stc: {h_bar: [50], lamda: [3], "
    "k_1: [0.02], k_2: [8.0e-5]}}}",
    "laws.py": "class Mine:\n    pass\n",
    "flights/one/metadata.yaml": "",
}
"""What the user has in the folder."""


class Typo(NamedTuple):
    typed: str
    """After ``space-robot``."""
    said: str
    """The line, without ``space-robot: error: ``; ... stands for any text."""


LAWS = "adrc, ctc, ctc_smc, dob, indi, pd, pd_feedforward, slotine_li, tde_smc, tde_stc, tde_tsmc"
ROBOTS = "boom, canadarm, canadarm2, dual_arm, ets_vii, flexible_panels, paper, seven_joint"
TRACK = "time, joint1, joint2, joint3, joint4, joint5, joint_6"
TYPOS = (
    # commands and options
    Typo(
        "simulte --case 3",
        "no such command 'simulte': did you mean simulate or sim? (... in all) "
        "(see: space-robot --help)",
    ),
    Typo(
        "campaign runn first",
        "no such command 'runn': choose one of report, run, rerun (did you mean run or rerun?) "
        "(see: space-robot campaign --help)",
    ),
    Typo(
        "simulate --contoller ctc",
        "no such option --contoller: did you mean --controller or --controller-code? "
        "(... in all) (see: space-robot simulate --help)",
    ),
    Typo(
        "sim step --tick 10",
        "no such option --tick: choose one of --ticks, --domain, --namespace "
        "(did you mean --ticks?) (see: space-robot sim step --help)",
    ),
    Typo("simulate ctc", "unexpected argument 'ctc' (see: space-robot simulate --help)"),
    Typo("simulate --mission", "option '--mission' requires an argument"),
    Typo(
        "help gians",
        "unknown topic 'gians': choose one of first-flight, ..., install (did you mean gains?)",
    ),
    # values of options
    Typo(
        "simulate --controller tde-stc",
        f"unknown controller 'tde-stc': choose one of {LAWS}, or file.py:Class or module:Class of "
        "your own (did you mean tde_stc, tde_smc or tde_tsmc?) (see: space-robot help own-law)",
    ),
    Typo(
        "simulate --case 5",
        "unknown case '5': choose one of 1, 2, 3, 4-1, 4-2, or a path to a .yaml file",
    ),
    Typo(
        "fly --robot papr",
        f"unknown robot 'papr': choose one of {ROBOTS}, or a path to a .yaml or .urdf file or a "
        "folder (did you mean paper?) (see: space-robot help own-robot)",
    ),
    Typo(
        "simulate --robot my",
        f"unknown robot 'my': choose one of {ROBOTS}, or a path to a .yaml or .urdf file or a "
        "folder (did you mean my.urdf?) (see: space-robot help own-robot)",
    ),
    Typo(
        "simulate --sensors tacitcal",
        "unknown sensor 'tacitcal': choose one of coarse, fine, ideal, tactical, white_l1, "
        "white_l2, or a path to a .yaml file (did you mean tactical?)",
    ),
    Typo(
        "simulate --gains robst",
        "unknown gain set 'robst' of robot 'paper': choose one of ... (did you mean robust?) "
        "(see: space-robot help gains)",
    ),
    Typo(
        "simulate --navigation filterd",
        "--navigation: unknown value 'filterd': choose one of direct, filtered "
        "(did you mean filtered?) (see: space-robot simulate --help)",
    ),
    Typo(
        "simulate --duration 10s",
        "--duration: a number was expected, got '10s'; it is: Seconds to fly [default: the "
        "mission's] (see: space-robot simulate --help)",
    ),
    Typo(
        "simulate --duration -1",
        "options: duration: Input should be greater than 0, got -1.0 (Seconds to fly [default: the "
        "mission's])",
    ),
    Typo(
        "simulate --period 500",
        "plant parameters: period: Input should be less than or equal to 0.1, got 500.0 (length "
        "of a tick, s; the same for all nodes)",
    ),
    Typo(
        "simulate --seed 1.5",
        "--seed: a whole number was expected, got '1.5'; it is: Seed of the random numbers of "
        "faults and sensors (see: space-robot simulate --help)",
    ),
    Typo(
        "fly --domain 300",
        "--domain: 300 is not in the range 0<=x<=232 (see: space-robot fly --help)",
    ),
    Typo(
        "simulate --swap '5;tde_smc'",
        "swap '5;tde_smc': T:LAW expected, T in simulated seconds, as in 5:tde_smc",
    ),
    Typo(
        "simulate --fault kil_controller@3",
        "fault 'kil_controller@3': unknown kind 'kil_controller': did you mean kill_controller, "
        "stop_controller or kill_recorder? (--fault list lists all ...) "
        "(see: space-robot help disturbances)",
    ),
    Typo(
        "simulate --fault noise_gyro@3s:1e-6",
        "fault 'noise_gyro@3s:1e-6': KIND@T[-END][:ARGUMENT] expected, T and END in simulated "
        "seconds, as in drop_state@2-3:0.1 (see: space-robot help disturbances)",
    ),
    Typo(
        "simulate --event capture@10:smal_satellite",
        "event 'capture@10:smal_satellite': unknown target 'smal_satellite': choose one of ..., "
        "or a path to a .yaml file (did you mean small_satellite or tumbling_satellite?)",
    ),
    Typo(
        "simulate --set plant.hold_tick=40",
        "plant parameters: hold_tick: unknown key, got 40: did you mean hold_ticks? (... in all)",
    ),
    Typo(
        "simulate --set hold_ticks=40",
        "--set 'hold_ticks=40': NODE.PARAM=VALUE expected, as in plant.hold_ticks=40",
    ),
    Typo(
        "goto --tool 0.2,0",
        "--tool: 3 numbers separated by commas were expected, got '0.2,0' "
        "(see: space-robot goto --help)",
    ),
    # files
    Typo(
        "robot my.udrf",
        f"unknown robot 'my.udrf': choose one of {ROBOTS}, or a path to a .yaml or .urdf file or "
        "a folder (did you mean my.urdf?) (see: space-robot help own-robot)",
    ),
    Typo(
        "robot mine.urdf",
        "mine.urdf: no such file (did you mean my.urdf?) (see: space-robot help own-robot)",
    ),
    Typo(
        "simulate --scenario scenario.yml",
        "scenario.yml: no such file (did you mean scenario.yaml?)",
    ),
    Typo(
        "simulate --scenario scenario.yaml",
        "unknown key 'contoller' in scenario.yaml: did you mean controller or controller_code? "
        "(... in all)",
    ),
    Typo(
        "simulate --scenario seconds.yaml",
        "seconds.yaml: duration: a number was expected, got '10 s'",
    ),
    Typo(
        "simulate --scenario tab.yaml",
        "tab.yaml: line 2: not YAML (found a tab character that violates indentation)",
    ),
    Typo("analyze flight/one", "flight/one: no such bag"),
    Typo("analyze flights/on", "flights/on: no such bag (did you mean flights/one?)"),
    Typo(
        "analyze flights",
        "flights: not a bag folder (no metadata.yaml, no .mcap) (did you mean flights/one?)",
    ),
    Typo("analyze my.urdf", "my.urdf: not a bag: neither .mcap nor .db3, nor a folder of them"),
    Typo(
        "simulate --gains gains",
        "unknown gain of tde_stc 'lamda' in gains/tde_stc.yaml: choose one of h_bar, lambda, k_1, "
        "k_2 (did you mean lambda?) (see: space-robot help gains)",
    ),
    Typo(
        "simulate --controller laws.py:Mime",
        "controller 'laws.py:Mime': laws.py has no class derived from ControlLaw "
        "(paths are from the current folder) (see: space-robot help own-law)",
    ),
    # robots
    Typo(
        "robot no_mass.urdf",
        "no_mass.urdf: line 11: link 'upper_arm': mass must be at least 0 kg, got '-10' "
        "(see: space-robot help own-robot)",
    ),
    Typo(
        "robot no_link.urdf",
        "no_link.urdf: line 27: joint 'elbow': the parent is not a known link (did you mean "
        "upper_arm or left_arm?), got 'uper_arm' (see: space-robot help own-robot)",
    ),
    Typo("robot no_end.urdf", "no_end.urdf: line 37: not XML (no element found)..."),
    Typo(
        "robot my.urdf --base satelite",
        "unknown link 'satelite' for the base of my.urdf: choose one of satellite, panel, "
        "upper_arm, left_arm, left_hand, right_hand (did you mean satellite?)...",
    ),
    Typo("robot kg.yaml", "kg.yaml: robot.base.mass: Input should be a valid number, got ..."),
    # missions
    Typo(
        "simulate --mission segmets.yaml",
        "segmets.yaml: mission: segmets: unknown key, got [{'hold': 2}]: choose one of events, "
        "limits, segments, start (did you mean segments or events?) (and 1 more) "
        "(see: space-robot help own-trajectory)",
    ),
    Typo(
        "simulate --mission joint_deg.yaml",
        "joint_deg.yaml: segment 1: joint_deg: unknown key, got [0, 90, 200, 20, 30, 10]: choose "
        "one of joints_deg, bends_deg, tool, hold, reactionless, file, base, duration "
        "(did you mean joints_deg?) (see: space-robot help own-trajectory)",
    ),
    Typo(
        "simulate --mission five_joints.yaml",
        "five_joints.yaml: the start has 5 joints; the robot has 6 with motors: joint1, joint2, "
        "joint3, joint4, joint5, joint6 (see: space-robot help own-trajectory)",
    ),
    Typo(
        "simulate --mission from_file.yaml",
        f"from_file.yaml: segment 1: trajectory: column 'joint6' is missing; there are {TRACK} "
        "(did you mean joint_6 or joint5 or joint4?) (see: space-robot help own-trajectory)",
    ),
    Typo(
        "plan no_file.yaml",
        "trak.csv: no such file (did you mean track.csv?) (see: space-robot help own-trajectory)",
    ),
    # campaigns
    Typo(
        "campaign run sensor_grade",
        "unknown campaign 'sensor_grade': choose one of ..., or a path to a .yaml file "
        "(did you mean sensor_grades?) (see: space-robot help campaign)",
    ),
    Typo(
        "campaign run scle.yaml --out x",
        "scle.yaml: vary.plant.echo_scle[*]: unknown parameter of the plant 'echo_scle': did you "
        "mean echo_scale, echo_bias or drive_scale? (... in all) (see: space-robot help campaign)",
    ),
    Typo(
        "campaign run unifrm.yaml --out x",
        "unifrm.yaml: vary.plant.echo_scale[*]: a distribution was expected, a mapping with one of "
        "normal, uniform, log_uniform, choice, grid, got {'unifrm': [0.99, 1.01]} "
        "(did you mean uniform or log_uniform?) (see: space-robot help campaign)",
    ),
    Typo(
        "campaign run metric.yaml --out x",
        "unknown metric 'atitude_max' in metric.yaml: require.pointing.metric: "
        "did you mean attitude_max, attitude_deg_max or attitude_rms? (29 in all) "
        "(see: space-robot help campaign)",
    ),
    Typo(
        "campaign run law.yaml --out x",
        "law.yaml: law: unknown key, got ['tde_stc', 'ctc']: choose one of ..., laws, ... "
        "(did you mean laws?) (and 1 more) (see: space-robot help campaign)",
    ),
)
"""By what is mistyped."""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's folder."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def said_is(line: str, said: str) -> bool:
    """Whether a line is what is expected, but for its dots."""
    pattern = ".*".join(map(re.escape, said.split("...")))
    return re.fullmatch(f"space-robot: error: {pattern}", line) is not None


@pytest.mark.parametrize("typo", TYPOS, ids=lambda typo: typo.typed)
def test_what_is_said(typo: Typo, here: Path, space_robot: Run) -> None:
    code, out, err = space_robot(*shlex.split(typo.typed))
    (line,) = err.splitlines()
    assert said_is(line, typo.said), line
    assert (code, out) == (2, "")
    assert sorted(here.rglob("*")) == sorted(
        {here / part for name in FILES for part in (name, *map(str, Path(name).parents))} - {here}
    )


@pytest.mark.parametrize("typo", [TYPOS[0], TYPOS[2], TYPOS[14]], ids=lambda typo: typo.typed)
def test_a_process_of_its_own_says_the_same(typo: Typo, here: Path) -> None:
    ended = started(*shlex.split(typo.typed))
    (line,) = ended.stderr.splitlines()
    assert said_is(line, typo.said), line
    assert (ended.returncode, ended.stdout) == (2, "")


def test_there_are_many() -> None:
    assert len({typo.typed for typo in TYPOS}) == len(TYPOS) >= 30
