"""Every shipped robot flies its mission under all laws with its own gains."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner
from flights import simulated
from paths import CONFIG

from space_robot.analysis import analyze
from space_robot.analysis.words import remarks, with_statistic
from space_robot.cli.main import cli
from space_robot_control.laws import laws
from space_robot_model.robot.find import robot_names

OTHERS = sorted({*robot_names()} - {"paper", "seven_joint"})
SECONDS = 1.0
"""Of each flight: it starts from rest with joint friction, which all joints have overcome then."""


ATTITUDE = {("canadarm2", "adrc"): 2e-5}
"""Largest RMS where it is not 1e-6: no diagonal inertia is near that of this arm and its base."""


@pytest.mark.parametrize("law", sorted(laws()))
@pytest.mark.parametrize("robot", robot_names())
def test_every_law_flies_it(robot: str, law: str) -> None:
    log = simulated(robot=robot, controller=law, gains="tuned", duration=SECONDS)
    report = analyze(log)
    assert not [text for text in remarks(report) if "beyond" in text], "limits of its file"
    rms = with_statistic(report["metrics"], "rms")
    assert rms.pop("attitude") < ATTITUDE.get((robot, law), 1e-6)
    for name, value in rms.items():
        if name.startswith("joints"):
            assert value < 3e-4, name
    moved = abs(log.joint_positions[-1] - log.joint_positions[0])
    assert moved.max() > 1e-4, "it moves"


@pytest.mark.parametrize("robot", OTHERS)
def test_the_command_in_its_gains_makes_them(robot: str, tmp_path: Path) -> None:
    shipped = CONFIG / "gains" / robot / "tuned"
    line = (shipped / "tde_stc.yaml").read_text("utf-8").splitlines()[0]
    program, *words, _, _ = shlex.split(line.removeprefix("# Made by `").removesuffix("`."))
    assert program == "space-robot"
    result = CliRunner().invoke(cli, [*words, "-o", str(tmp_path)])
    assert result.exit_code == 0, result.exception
    for file in shipped.glob("*.yaml"):
        made = (tmp_path / file.name).read_text("utf-8").splitlines()
        assert made[1:] == file.read_text("utf-8").splitlines()[1:], file.name
