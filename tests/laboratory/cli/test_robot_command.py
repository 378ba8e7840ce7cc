"""``space-robot robot`` and ``urdf``, and what commands say of URDFs that are wrong."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from click.testing import CliRunner, Result
from paths import CONFIG, DATA
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


def test_tables() -> None:
    result = run(ARM)
    assert result.exit_code == 0
    shown = ("robot arm: 330 kg, 2 joints with a motor", "40, 50, 60", "-57.296 to 114.59 deg")
    shown += ("0 to 0.6 m", "0.05 m/s", "20 N", "0.3, 0.4", "hand", "(missing)", "cylinder")
    assert [words for words in shown if words not in result.stdout] == []


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


GEARED = """
robot:
  name: lift
  base: {mass: 200.0, inertia: [20.0, 20.0, 20.0, 0, 0, 0]}
  links:
    - {name: slide, joint: prismatic, mass: 5.0, inertia: [0.1, 0.1, 0.1, 0, 0, 0], com: [0, 0, 0],
       drive: {rotor_inertia: 2.0e-4, gear_ratio: 500.0, stiffness: 3.0e4, encoder: link}}
    - {name: turn, mass: 4.0, inertia: [0.1, 0.1, 0.1, 0, 0, 0], com: [0, 0, 0],
       drive: {rotor_inertia: 1.5e-5, gear_ratio: 120.0, stiffness: 8000.0, damping: 12.0}}
    - {name: rigid, mass: 3.0, inertia: [0.1, 0.1, 0.1, 0, 0, 0], com: [0, 0, 0]}
"""

PLATES = """
  plates:
    - {area: 2.5, normal: [1, 0, 0]}
    - {area: 1.25, normal: [0, 1, 0]}
    - {area: 0.5, normal: [0, 0, 1], link: turn}
"""


def test_drives(tmp_path: Path) -> None:
    yaml = tmp_path / "lift.yaml"
    yaml.write_text(GEARED)
    slide, turn, rigid = report(yaml)["joints"]
    assert slide["drive"] == {
        "rotor_inertia": 2.0e-4,
        "gear_ratio": 500.0,
        "stiffness": 3.0e4,
        "damping": 0.0,
        "encoder": "link",
        "reflected_inertia": pytest.approx(50.0),  # kg
    }
    assert turn["drive"]["reflected_inertia"] == pytest.approx(0.216)
    assert turn["drive"]["encoder"] == "motor"
    assert "drive" not in rigid
    shown = run(yaml).stdout.partition("Drives")[2]
    for words in ("500 rad/m", "50 kg", "3e+04 N/m", "0 N s/m", "0.216 kg m2", "12 N m s/rad"):
        assert words in shown
    assert "Drives" not in run("paper").stdout


def test_plates_of_the_file_and_of_the_shapes(tmp_path: Path) -> None:
    yaml = tmp_path / "lift.yaml"
    yaml.write_text(GEARED + PLATES)
    found = report(yaml)["plates"]
    assert (found["source"], found["count"], found["area"]) == ("file", 3, 4.25)
    bodies = {body["name"]: (body["count"], body["area"]) for body in found["bodies"]}
    assert bodies == {"base": (2, 3.75), "turn": (1, 0.5)}
    shown = run(yaml).stdout.partition("Plates")[2]
    assert re.search(r"together +│ +3 +│ +4.25", shown)
    assert "those of the file" in shown
    assert "made from the shapes" in run(ARM).stdout


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
