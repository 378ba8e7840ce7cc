"""Reading of a robot's file, YAML or URDF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.config.yaml_text import parse_yaml, read_file
from space_robot_msgs_py.errors import InputError

from ..elementary.matrices import product
from ..elementary.rotations import rpy_of_rotation
from .inertia import inertia_elements
from .link_file import BASE, drive_of
from .robot import Robot
from .urdf_file import is_urdf
from .visual_file import shape_of

YAML, URDF = (".yaml", ".yml"), (".urdf", ".xacro")


Array = NDArray[np.float64]


def document_of(robot: Robot) -> dict[str, Any]:
    """Return the mapping from which `Robot.from_dict` builds the same robot.

    Frames are written in degrees, so numbers may differ from the robot's in their last digits. The
    order of joints is kept.
    """
    links = [_link(robot, joint) for joint in range(robot.joint_count)]
    carriers = (BASE, *robot.all_joint_names)
    return {
        "robot": {
            "name": robot.name,
            "base": {"mass": float(robot.mass[0]), "inertia": _inertia(robot, 0)},
            "links": links,
            "tools": [
                {
                    "name": tool.name,
                    "link": carriers[tool.body],
                    "origin": _origin(tool.rotation, tool.position),
                }
                for tool in robot.tools
            ],
            **({"plates": _plates(robot, carriers)} if robot.plates else {}),
            **({"visuals": _visuals(robot, carriers)} if robot.visuals else {}),
        }
    }


def _link(robot: Robot, joint: int) -> dict[str, Any]:
    body, rotation = joint + 1, robot.rotation[joint]
    is_prismatic = bool(robot.is_prismatic[joint])
    link: dict[str, Any] = {
        "name": robot.all_joint_names[joint],
        "parent": (BASE, *robot.all_joint_names)[robot.parent[joint]],
        "joint": "prismatic" if is_prismatic else "revolute",
        "origin": _origin(rotation, product(rotation, robot.offset[joint])),
        "mass": float(robot.mass[body]),
        "inertia": _inertia(robot, body),
        "com": _numbers(robot.com[body]),
    }
    friction = robot.friction[joint]
    if np.isfinite(friction.coulomb):
        link["friction"] = {"coulomb": friction.coulomb, "viscous": friction.viscous}
    if joint < robot.n:
        if limits := _limits(robot, joint):
            link["limits"] = limits
        if robot.gears and (gear := robot.gears[joint]):
            link["drive"] = drive_of(gear)
        return link
    spring = robot.springs[joint - robot.n]
    rest = spring.rest if is_prismatic else float(np.degrees(spring.rest))
    link["passive"] = {"stiffness": spring.stiffness, "damping": spring.damping, "rest_deg": rest}
    return link


def _plates(robot: Robot, carriers: Sequence[str]) -> list[dict[str, Any]]:
    return [
        {
            "link": carriers[plate.body],
            "area": plate.area,
            "normal": _numbers(plate.normal),
            "centre": _numbers(plate.centre),
            "drag_coefficient": plate.drag_coefficient,
            "specular": plate.specular,
            "diffuse": plate.diffuse,
        }
        for plate in robot.plates
    ]


def _visuals(robot: Robot, carriers: Sequence[str]) -> list[dict[str, Any]]:
    return [
        {
            "link": carriers[visual.body],
            **shape_of(visual),
            "origin": _origin(visual.rotation, visual.position),
        }
        for visual in robot.visuals
    ]


def _limits(robot: Robot, joint: int) -> dict[str, Any]:
    own, is_prismatic = robot.limits[joint], robot.is_prismatic[joint]

    def number(value: float) -> float:
        return float(value if is_prismatic else np.degrees(value))

    limits: dict[str, Any] = {}
    if np.isfinite((own.lower, own.upper)).all():
        limits["position_deg"] = [number(own.lower), number(own.upper)]
    if np.isfinite(own.velocity):
        limits["velocity_deg"] = number(own.velocity)
    if np.isfinite(own.effort):
        limits["effort"] = float(own.effort)
    return limits


def _origin(rotation: Array, position: Array) -> dict[str, Any]:
    return {"xyz": _numbers(position), "rpy_deg": _numbers(np.degrees(rpy_of_rotation(rotation)))}


def _inertia(robot: Robot, body: int) -> list[float]:
    return _numbers(inertia_elements(robot.inertia[body]))


def _numbers(values: Array) -> list[float]:
    """Return floats without negative zeros."""
    return [float(value) + 0.0 for value in values]


@dataclass(frozen=True)
class RobotSource:
    """Content of a robot's file."""

    where: str
    """Name of the file, for errors."""
    content: dict[str, Any]
    """Self-contained mapping for `Robot.from_dict`."""
    text: str
    """The same as the text of a YAML file; for a YAML file its own text."""
    findings: tuple[str, ...] = ()
    """Defects of a URDF that were repaired."""

    @cached_property
    def robot(self) -> Robot:
        """The robot, built from `content`, hence equal to that of a bag with this content."""
        return replace(Robot.from_dict(self.content, where=self.where), repairs=self.findings)


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
    return RobotSource(str(file), content, text, robot.repairs)
