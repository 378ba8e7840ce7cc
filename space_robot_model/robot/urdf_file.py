"""YAML files of robots that refer to a URDF, with additional data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.validation import StrictModel, validate

from .link_file import BASE, DriveFile, PassiveFile
from .plate_file import Plates
from .tree import Spring
from .urdf.read import UrdfRobot, parse_urdf, read_urdf, with_gears, with_plates, with_springs

KEYS = ("urdf", "urdf_text")
"""Keys in ``robot`` that refer to a URDF."""


class UrdfFile(StrictModel):
    """Key ``robot`` of a YAML that refers to a URDF."""

    name: str = ""
    """Name of the robot; that of the URDF if empty."""
    urdf: str = ""
    """Path of the URDF or xacro file, relative to the folder of the YAML."""
    urdf_text: str = ""
    """Text of the URDF, instead of a path."""
    base: Annotated[str, Field(min_length=1)] | None = None
    """Name of the link that is the satellite; default: the root."""
    repair: bool = False
    """True to repair defects."""
    passive: Annotated[dict[str, PassiveFile], Field(default_factory=dict)]
    """Springs of the passive joints, by joint name."""
    drives: Annotated[dict[str, DriveFile], Field(default_factory=dict)]
    """Drives of joints with gears, by joint name."""
    plates: Plates = Field([])
    """Surfaces for drag and sunlight; `link` is the URDF's, or base for the satellite."""
    tools: list[str] | None = None
    """Links whose frames are tools, in order of rank; default: the ends of the branches."""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if bool(self.urdf) == bool(self.urdf_text):
            raise ValueError("either urdf or urdf_text is needed, and not both")
        return self

    def read(self, folder: Path, where: str) -> UrdfRobot:
        """Read the URDF, with a path relative to ``folder``, and add what the YAML has."""
        if self.urdf:
            urdf = read_urdf(folder / self.urdf, self.base, self.repair, self.tools)
        else:
            path = folder / f"{self.name or 'robot'}.urdf"
            urdf = parse_urdf(self.urdf_text, path, self.base, self.repair, self.tools)
        is_prismatic = {
            body.joint.name: body.joint.kind == "prismatic" for body in urdf.bodies if body.joint
        }
        springs = {
            name: Spring(
                springs_of_joint.stiffness,
                springs_of_joint.damping,
                springs_of_joint.rest_deg
                if is_prismatic.get(name)
                else float(np.radians(springs_of_joint.rest_deg)),
            )
            for name, springs_of_joint in self.passive.items()
        }
        urdf = with_springs(urdf, springs, where)
        urdf = with_gears(urdf, {name: drive.gear for name, drive in self.drives.items()}, where)
        links = [body.name for body in urdf.bodies]
        plates = [
            (links[0] if plate.link == BASE and BASE not in links else plate.link, plate.plate)
            for plate in self.plates
        ]
        urdf = with_plates(urdf, plates, where)
        return replace(urdf, name=self.name or urdf.name)


class _UrdfDocument(StrictModel):
    robot: UrdfFile


def is_urdf(content: dict[str, Any]) -> bool:
    """Return True if the content of a robot's YAML refers to a URDF."""
    robot = content.get("robot")
    return isinstance(robot, dict) and any(key in robot for key in KEYS)


def read_urdf_content(content: dict[str, Any], folder: Path, where: str) -> UrdfRobot:
    """Read the URDF that a robot's YAML refers to.

    Args:
        content: of the YAML; see `is_urdf`.
        folder: of the YAML.
        where: name of the YAML, for errors.

    Raises:
        InputError: the YAML or the URDF is invalid.
    """
    return validate(_UrdfDocument, content, where).robot.read(folder, where)


def complete_content(content: dict[str, Any], folder: Path, where: str) -> dict[str, Any]:
    """Return the content of a YAML with the URDF's text instead of its path."""
    file = validate(_UrdfDocument, content, where).robot
    urdf = file.read(folder, where)
    robot = {key: value for key, value in content["robot"].items() if key != "urdf"}
    return {"robot": {"name": urdf.name, **robot, "urdf_text": urdf.text}}
