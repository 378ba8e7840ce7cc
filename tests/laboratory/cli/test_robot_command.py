"""``space-robot robot`` and ``urdf``, and what commands say of URDFs that are wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from click.testing import CliRunner, Result
from paths import DATA
from urdf_defects import GOOD

from space_robot.cli.main import _run, cli
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.urdf_text import urdf_text
from space_robot_msgs_py.errors import InputError

ARM = DATA / "arm.urdf"


def run(*arguments: object) -> Result:
    runner = CliRunner(env={"COLUMNS": "120"})
    return runner.invoke(cli, ["robot", *map(str, arguments)])


def report(*arguments: object) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(run(*arguments, "--json").stdout)
    return found


@pytest.fixture
def bad(tmp_path: Path) -> Path:
    """A URDF with two defects that can be repaired."""
    path = tmp_path / "bad.urdf"
    path.write_text(GOOD.replace('izz="60"', 'izz="95"').replace('upper="2"', 'upper="-2"'))
    return path


def test_defects_are_listed_and_end_in_an_error(bad: Path) -> None:
    result = run(bad)
    assert isinstance(result.exception, InputError)
    assert str(result.exception) == f"{bad}: 2 defects to repair: --repair does so"
    assert "above upper" in result.stdout
    assert "Bodies" not in result.stdout, "nothing is repaired unasked"
    found = report(bad)
    assert [defect["line"] for defect in found["defects"]] == [7, 42]
    assert found["defects"][1] == {
        "part": "joint 'shoulder'",
        "line": 42,
        "value": "'-1 to -2'",
        "repair": "exchanged",
        "defect": "lower is above upper",
    }


def test_repaired_and_written(bad: Path, tmp_path: Path) -> None:
    yaml = tmp_path / "robot.yaml"
    result = run(bad, "--repair", "--out", yaml)
    assert result.exit_code == 0
    assert "exchanged" in result.stdout
    assert "Repaired: line 42: joint 'shoulder'" in yaml.read_text()
    written, robot = find_robot(str(yaml)), Robot.from_urdf(bad, repair=True)
    assert written.joint_names == robot.joint_names
    for name in ("mass", "inertia", "com", "rotation", "offset"):
        np.testing.assert_allclose(
            getattr(written, name), getattr(robot, name), rtol=1e-14, atol=1e-13
        )
    assert report(bad, "--repair")["defects"]


def test_base_and_repair_are_a_part_of_the_name(
    bad: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of every command that takes --robot."""
    for command in (["simulate"], ["fly"], ["stability"], ["gains", "check"]):
        assert _run([*command, "--robot", str(bad), "--base", "fore", "--repair"]) == 2
        assert f"`space-robot new {bad} --base fore --repair`" in capsys.readouterr().err
        assert _run([*command, "--robot", str(bad), "--base", "fore"]) == 2
        assert "triangle" in capsys.readouterr().err
    assert report(f"{bad}?base=fore&repair") == report(bad, "--base", "fore", "--repair")
    assert _run(["simulate", "--base", "fore"]) == 2
    assert "not a URDF" in capsys.readouterr().err


def urdf(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["urdf", *map(str, arguments)])


@pytest.mark.parametrize("robot", ["dual_arm", DATA / "arm.urdf"], ids=["yaml", "urdf"])
def test_the_text_is_that_of_the_robot_that_flies(robot: object, tmp_path: Path) -> None:
    """Alone on standard output, and the same in a file."""
    expected = urdf_text(find_robot(str(robot)))
    assert urdf(robot).stdout == expected
    file = tmp_path / "robot.urdf"
    result = urdf(robot, "--out", file)
    assert (result.exit_code, result.stdout) == (0, "")
    assert result.stderr == f"wrote {file}\n"
    assert file.read_text("utf-8") == expected
    model = pin.buildModelFromUrdf(str(file), pin.JointModelFreeFlyer())
    assert model.nv == 6 + find_robot(str(robot)).joint_count
