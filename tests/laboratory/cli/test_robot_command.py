"""``space-robot robot``, and what commands say of URDFs that are wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from flights import space_robot_here
from paths import CONFIG, DATA
from urdf_defects import DEFECTS, GOOD, with_defect

from space_robot.cli.main import _run, cli
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
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


def test_tables() -> None:
    result = run(ARM)
    assert result.exit_code == 0
    for words in (
        "robot arm: 330 kg, 2 joints with a motor",
        "40, 50, 60",
        "-57.296 to 114.59 deg",
        "0 to 0.6 m",
        "0.05 m/s",
        "20 N",
        "0.3, 0.4",
        "hand",
        "(missing)",
        "cylinder",
    ):
        assert words in result.stdout


def test_json_has_all_numbers() -> None:
    found, robot = report(ARM), Robot.from_urdf(ARM)
    assert [body["name"] for body in found["bodies"]] == list(robot.body_names)
    np.testing.assert_array_equal([body["mass"] for body in found["bodies"]], robot.mass)
    np.testing.assert_array_equal([body["inertia"] for body in found["bodies"]], robot.inertia)
    np.testing.assert_array_equal([body["com"] for body in found["bodies"]], robot.com)
    assert found["joint_names"] == ["shoulder", "slide"]
    shoulder, slide = found["joints"]
    assert shoulder["limits"] == {"lower": -1.0, "upper": 2.0, "velocity": 0.1, "effort": 50.0}
    assert shoulder["friction"] == {"coulomb": 0.3, "viscous": 0.4}
    assert (slide["kind"], slide["parent"], slide["child"]) == ("prismatic", "upper", "fore")
    assert slide["friction"] is None
    assert [shape["shape"] for shape in found["shapes"]] == ["box", "cylinder", "mesh", "sphere"]
    assert found["defects"] == []


def test_base() -> None:
    assert report(ARM, "--base", "fore")["bodies"][0]["name"] == "fore"
    result = run(ARM, "--base", "tail")
    assert isinstance(result.exception, InputError)
    assert "unknown link 'tail'" in str(result.exception)


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


def test_robots_that_are_no_urdf(tmp_path: Path) -> None:
    assert "464 kg, 7 joints" in run("seven_joint").stdout
    assert report("seven_joint")["name"] == "seven_joint"
    assert report(CONFIG / "robots" / "paper.yaml")["mass"] == 860.0
    yaml = tmp_path / "mine.yaml"
    yaml.write_text(
        f"robot: {{urdf: {ARM}, passive: {{slide: {{stiffness: 10.0, damping: 0.5}}}}}}\n"
    )
    found = report(yaml)
    assert found["passive_names"] == ["slide"]
    assert "10, 0.5, 0" in run(yaml).stdout
    result = run(yaml, "--repair")
    assert isinstance(result.exception, InputError)
    assert "not a URDF" in str(result.exception)


@pytest.mark.parametrize("name", DEFECTS)
def test_every_defect_is_one_line_of_every_command(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "given.urdf"
    path.write_text(with_defect(name))
    for command in (["simulate", "--robot", str(path)], ["robot", str(path)]):
        assert _run(command) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert said.startswith(f"space-robot: error: {path}: ")
        assert DEFECTS[name].text in said or command[0] == "robot"


@pytest.mark.parametrize("name", ["not XML", "triangle inequality", "circle"])
def test_the_process_ends_with_code_2(name: str, tmp_path: Path) -> None:
    path = tmp_path / "given.urdf"
    path.write_text(with_defect(name))
    result = space_robot_here("simulate", "--robot", str(path))
    assert result.returncode == 2
    assert result.stdout == ""
    assert result.stderr.startswith(f"space-robot: error: {path}: ")
    assert DEFECTS[name].text in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_sound_urdf_lacks_a_mission_only(capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(["simulate", "--robot", str(ARM)]) == 2
    assert "has no mission of its own: `space-robot new" in capsys.readouterr().err


def test_base_and_repair_are_a_part_of_the_name(
    bad: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of every command that takes --robot."""
    for command in (["simulate"], ["fly"], ["stability"], ["gains", "check"]):
        assert _run([*command, "--robot", str(bad), "--base", "fore", "--repair"]) == 2
        assert f"`space-robot new {bad} --base fore --repair`" in capsys.readouterr().err
        assert _run([*command, "--robot", str(bad), "--base", "fore"]) == 2
        assert "triangle" in capsys.readouterr().err
    assert _run(["simulate", "--base", "fore"]) == 2
    assert "not a URDF" in capsys.readouterr().err
