"""The shipped sets ``robust`` and ``nominal``: made by the command they name, and flying."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner
from paths import CONFIG

from space_robot.campaign.row.fly import RowFlyer
from space_robot.campaign.row.row import Task
from space_robot.campaign.study import Study, read_study
from space_robot.cli.main import cli
from space_robot_control.laws import laws

ROBOTS = ("paper", "seven_joint")
CASES = ("1", "2", "3", "4-1", "4-2")


def files(folder: Path) -> dict[str, list[str]]:
    return {file.name: file.read_text("utf-8").splitlines() for file in folder.glob("*.yaml")}


@pytest.mark.parametrize(
    ("robot", "gains"),
    [*((robot, "robust") for robot in ROBOTS), ("ets_vii", "robust"), ("paper", "nominal")],
)
def test_the_command_in_the_files_makes_them(robot: str, gains: str, tmp_path: Path) -> None:
    shipped = files(CONFIG / "gains" / robot / gains)
    line = shipped["tde_stc.yaml"][0]
    program, *words, _, _ = shlex.split(line.removeprefix("# Made by `").removesuffix("`."))
    assert program == "space-robot"
    result = CliRunner().invoke(cli, [*words, "-o", str(tmp_path)])
    assert result.exit_code == 0, result.exception
    made = files(tmp_path)
    assert made.keys() == shipped.keys()
    for name, lines in made.items():
        assert lines[1:] == shipped[name][1:], name
        assert shipped[name][0] == line


@pytest.mark.parametrize("robot", ROBOTS)
def test_it_is_sound(robot: str) -> None:
    """But for the nominal inertia of robot seven_joint, whose light wrist the payload outweighs."""
    for case in ("1", "4-2"):
        command = ["gains", "check", "--robot", robot, "--gains", "robust", "--case", case]
        result = CliRunner().invoke(cli, command)
        assert result.exit_code == 0, result.exception
        is_thin = (robot, case) == ("seven_joint", "4-2")
        remark = "remark: indi: the nominal inertia leaves a margin below 2% in torque scale\n"
        assert result.stderr == (remark if is_thin else "")


@pytest.mark.parametrize("law", sorted(laws()))
@pytest.mark.parametrize("case", CASES)
def test_all_laws_fly_all_cases_with_what_reality_brings(law: str, case: str) -> None:
    """Fine sensors, filtered navigation, masses within 20 %, 2 % too much or too little torque."""
    for seed, echo in ((1, 1.02), (2, 0.98)):
        scenario = {
            "case": case,
            "sensors": "fine",
            "navigation": "filtered",
            "duration": 10.0,
            "parameters": {"plant": {"echo_scale": [echo]}},
        }
        off = {k: v for k, v in read_study("sensor_grades").vary.items() if k.startswith("robot.")}
        laws = [f"{law}=robust"]
        study = Study.model_validate({"scenario": scenario, "laws": laws, "vary": off})
        row = RowFlyer.of(study, seed, 1)(Task(0, laws[0]))
        assert row.is_complete
        assert row.metrics["attitude_rms"] < 1e-3
        assert row.metrics["joints_4_6_rms"] < 0.05
