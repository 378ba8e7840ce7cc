"""Every defect of a URDF ends in one line: part, line, value, and the repair if there is one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from urdf_defects import DEFECTS, FORE, GOOD, LIMIT, with_defect

from space_robot_model.robot import Robot
from space_robot_model.robot.urdf import read_urdf
from space_robot_msgs_py.errors import InputError


@pytest.fixture
def given(tmp_path: Path) -> Path:
    return tmp_path / "given.urdf"


@pytest.mark.parametrize("name", DEFECTS)
def test_a_defect_is_named_in_one_line(name: str, given: Path) -> None:
    defect = DEFECTS[name]
    given.write_text(with_defect(name))
    with pytest.raises(InputError) as raised:
        Robot.from_urdf(given)
    said = str(raised.value)
    assert "\n" not in said
    line = f"line {defect.line}: " if defect.line else ""
    assert said.startswith(f"{given}: {line}{defect.part}")
    assert defect.text in said
    assert ("(with --repair: " in said) == bool(defect.repair)
    assert f"(with --repair: {defect.repair}" in said or not defect.repair


@pytest.mark.parametrize("name", [name for name in DEFECTS if DEFECTS[name].repair])
def test_a_repair_is_told_and_leaves_a_robot(name: str, given: Path) -> None:
    defect = DEFECTS[name]
    given.write_text(with_defect(name))
    found = read_urdf(given, repair=True)
    first = found.findings[0]
    assert (first.part, first.line) == (defect.part, defect.line)
    assert first.repair.startswith(defect.repair) or defect.repair in first.repair
    assert str(first).startswith(f"line {defect.line}: {defect.part}: ")
    assert "\n" not in "".join(str(finding) for finding in found.findings)
    robot = Robot.of_tree(found.name, found.bodies)
    assert robot.n == (1 if "locked" in first.repair else 2)
    given.write_text(GOOD)
    assert not read_urdf(given, repair=True).findings


@pytest.mark.parametrize("name", [name for name in DEFECTS if not DEFECTS[name].repair])
def test_what_has_no_repair_stays_an_error(name: str, given: Path) -> None:
    given.write_text(with_defect(name))
    with pytest.raises(InputError) as plain:
        read_urdf(given)
    with pytest.raises(InputError) as repaired:
        read_urdf(given, repair=True)
    assert str(plain.value) == str(repaired.value)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("<robot name", '<robot xmlns:xacro="http://x" version="1.0" name'),
        ("</robot>", "<gazebo><plugin/></gazebo><transmission/><ros2_control/></robot>"),
        ("</visual>\n  </link>", "</visual><collision/><drake:x/>\n  </link>"),
        ('<child link="hand"/>', '<child link="hand"/><axis xyz="0 0 0"/><limit/>'),
        ('revolute">', 'continuous">'),
        ("fore.stl", "nowhere.stl"),
        ('"0 1 0"', '"0 0.9999 0"'),
        ('lower="0" upper="0.6"', 'lower="-inf" upper="inf"'),
        ('<material name="grey"/>', '<material name="nobody knows it"/>'),
    ],
)
def test_what_is_no_defect(old: str, new: str, given: Path) -> None:
    assert old in GOOD
    given.write_text(GOOD.replace(old, new, 1))
    assert Robot.from_urdf(given).n == 2


def test_all_defects_are_counted(given: Path) -> None:
    given.write_text(GOOD.replace(LIMIT, "").replace('iyy="50"', 'iyy="-5"'))
    with pytest.raises(InputError, match=r"line 7: .*\(and 1 more\)$"):
        read_urdf(given)
    assert [finding.line for finding in read_urdf(given, repair=True).findings] == [7, 37]


def test_next_to_no_mass_has_no_inertia(given: Path) -> None:
    """Else it would be added, unphysical perhaps, to that of the link it is merged into."""
    given.write_text(GOOD.replace(FORE, '<mass value="1e-12"/>'))
    found = read_urdf(given, repair=True)
    assert [finding.repair.split()[-1] for finding in found.findings] == ["'upper'", "ignored"]
    robot = Robot.of_tree(found.name, found.bodies)
    np.testing.assert_allclose(np.linalg.eigvalsh(robot.inertia[1]), [0.5, 1.9, 2.1])
