"""``space-robot urdf``: the text of a robot, to the screen or to a file that Pinocchio reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from click.testing import CliRunner, Result
from paths import DATA
from urdf_defects import GOOD

from space_robot.cli.main import cli
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.urdf_text import urdf_text
from space_robot_msgs_py.errors import InputError


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["urdf", *map(str, arguments)])


@pytest.mark.parametrize("robot", ["dual_arm", DATA / "arm.urdf"], ids=["yaml", "urdf"])
def test_the_text_is_that_of_the_robot_that_flies(robot: object, tmp_path: Path) -> None:
    """Alone on standard output, and the same in a file."""
    expected = urdf_text(find_robot(str(robot)))
    assert run(robot).stdout == expected
    file = tmp_path / "robot.urdf"
    result = run(robot, "--out", file)
    assert (result.exit_code, result.stdout) == (0, "")
    assert result.stderr == f"wrote {file}\n"
    assert file.read_text("utf-8") == expected
    model = pin.buildModelFromUrdf(str(file), pin.JointModelFreeFlyer())
    assert model.nv == 6 + find_robot(str(robot)).joint_count


def test_base_and_repairs(tmp_path: Path) -> None:
    """A URDF with defects becomes one without, its satellite the link that is named."""
    bad, mended = tmp_path / "bad.urdf", tmp_path / "mended.urdf"
    bad.write_text(GOOD.replace('upper="2"', 'upper="-2"'))
    result = run(bad)
    assert isinstance(result.exception, InputError)
    assert "above upper" in str(result.exception)
    result = run(bad, "--repair", "--out", mended)
    assert result.exit_code == 0
    assert "repaired: line" in result.stderr
    found, robot = Robot.from_urdf(mended), Robot.from_urdf(bad, repair=True)
    np.testing.assert_allclose(found.limits, robot.limits, rtol=1e-15)  # by way of degrees
    assert found.mass.tolist() == robot.mass.tolist()
    other = run(DATA / "arm.urdf", "--base", "fore").stdout
    (base,) = (body for body in Robot.from_dict({"robot": {"urdf_text": other}}).bodies()[:1])
    assert base.mass == 10.0
