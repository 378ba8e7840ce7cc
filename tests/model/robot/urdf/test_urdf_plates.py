"""Plates on the links of a URDF, in the links' frames."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from paths import DATA

from space_robot_model.robot import Robot

CENTRE, NORMAL = [0.1, -0.2, 0.3], [0.6, 0.0, -0.8]


def robot_of(folder: Path, link: str, base: str | None) -> Robot:
    """The arm with a plate on a link, read from a file that refers to the URDF."""
    shutil.copy(DATA / "arm.urdf", folder)
    plate = {"link": link, "area": 2.0, "normal": NORMAL, "centre": CENTRE}
    content = {"robot": {"urdf": "arm.urdf", "base": base, "plates": [plate]}}
    (folder / "arm.yaml").write_text(yaml.safe_dump(content))
    return Robot.from_yaml(folder / "arm.yaml")


@pytest.mark.parametrize("base", [None, "fore"])
def test_a_plate_is_in_its_links_frame(base: str | None, tmp_path: Path) -> None:
    """Also where the base is not the URDF's root: the upper link gets another frame there.

    The link's cylinder is at the origin of its frame, with the same axes.
    """
    robot = robot_of(tmp_path, "upper", base)
    (cylinder,) = (visual for visual in robot.visuals if visual.shape == "cylinder")
    (plate,) = robot.plates
    assert plate.body == cylinder.body
    np.testing.assert_allclose(
        plate.centre, cylinder.position + cylinder.rotation @ CENTRE, atol=1e-15
    )
    np.testing.assert_allclose(plate.normal, cylinder.rotation @ NORMAL, atol=1e-15)
    moved = base is not None
    assert moved == bool(np.linalg.norm(cylinder.position) > 0.1)


def test_base_is_the_satellite(tmp_path: Path) -> None:
    (plate,) = robot_of(tmp_path, "base", None).plates
    (other,) = robot_of(tmp_path, "hull", None).plates
    assert plate.body == other.body == 0
    np.testing.assert_array_equal(plate.centre, other.centre)
