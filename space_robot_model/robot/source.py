"""Reading of a robot's file, YAML or URDF."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import yaml

from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.config.yaml_text import parse_yaml, read_file
from space_robot_msgs_py.errors import InputError

from .document import document_of
from .robot import Robot
from .tree import Visual
from .urdf_file import is_urdf

YAML, URDF = (".yaml", ".yml"), (".urdf", ".xacro")


@dataclass(frozen=True)
class RobotSource:
    """Content of a robot's file."""

    where: str
    """Name of the file, for errors."""
    content: dict[str, Any]
    """Self-contained mapping for `Robot.from_dict`."""
    text: str
    """The same as the text of a YAML file; for a YAML file its own text."""
    visuals: tuple[Visual, ...] = ()
    """Visuals of a URDF; a YAML file has none."""
    findings: tuple[str, ...] = ()
    """Defects of a URDF that were repaired."""

    @cached_property
    def robot(self) -> Robot:
        """The robot, built from `content`, hence equal to that of a bag with this content."""
        robot = Robot.from_dict(self.content, where=self.where)
        return replace(robot, visuals=self.visuals, repairs=self.findings)


def read_robot_file(file: Path, base: str | None = None, repair: bool = False) -> RobotSource:
    """Read a robot's file.

    Args:
        file: YAML or URDF.
        base: the link that is the satellite, of a URDF (None: its root).
        repair: whether a URDF's defects are repaired.

    Raises:
        InputError: the file is invalid, or ``base`` or ``repair`` is set for a YAML.
    """
    if file.suffix in URDF:
        return _of_urdf(file, base, repair)
    if base or repair:
        raise InputError(f"{file}: not a URDF, so base and repair cannot be chosen")
    content = read_yaml(file)
    if not is_urdf(content):
        return _of_yaml(str(file), read_file(file))
    robot = Robot.from_yaml(file)
    return _of_robot(robot, file, f"From {file.name} and the URDF that it refers to.")


@lru_cache(maxsize=16)
def _of_yaml(where: str, text: str) -> RobotSource:
    """Return the source of a YAML text; cached, since many flights use the same robot."""
    return RobotSource(where, parse_yaml(text), text)


def _of_urdf(file: Path, base: str | None, repair: bool) -> RobotSource:
    robot = Robot.from_urdf(file, base, repair)
    return _of_robot(robot, file, f"From {file.name}{f', base {base}' if base else ''}.")


def _of_robot(robot: Robot, file: Path, head: str) -> RobotSource:
    content = document_of(robot)
    comments = [head, *(f"Repaired: {text}" for text in robot.repairs)]
    text = "".join(f"# {line}\n" for line in comments) + yaml.safe_dump(
        content, sort_keys=False, default_flow_style=None, width=10_000, allow_unicode=True
    )
    return RobotSource(str(file), content, text, robot.visuals, robot.repairs)
