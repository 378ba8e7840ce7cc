"""A robot as the content of a YAML: with its parts, or one that refers to a URDF."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import StrictModel, one_of, short, validate
from space_robot_msgs_py.errors import InputError

from ..elementary.matrices import Array, product
from ..elementary.rotations import rpy_of_rotation
from .inertia import inertia_elements
from .names import BASE
from .parts import (
    Body,
    Drive,
    Gear,
    Name,
    Plate,
    Plates,
    RobotPart,
    RobotTree,
    Spring,
    Visual,
    moved,
)
from .urdf import UrdfRobot, read_urdf
from .urdf_xml import IDENTITY


class RobotDocument(StrictModel):
    """A robot's YAML."""

    robot: RobotTree


@dataclass(frozen=True, kw_only=True)
class UrdfReference(RobotPart):
    """Key ``robot`` of a YAML that refers to a URDF, with what a URDF cannot say."""

    name: str = ""
    """Name of the robot; that of the URDF if empty."""
    urdf: str = ""
    """Path of the URDF or xacro file, relative to the folder of the YAML."""
    urdf_text: str = ""
    """Text of the URDF, instead of a path."""
    base: Name | None = None
    """Name of the link that is the satellite; default: the root."""
    repair: Annotated[bool, Field(strict=True)] = False
    """True to repair defects."""
    passive: dict[str, Spring] = field(default_factory=dict)
    """Springs of the passive joints, by joint name."""
    drives: dict[str, Drive] = field(default_factory=dict)
    """Drives of joints with gears, by joint name."""
    plates: Plates = field(default_factory=list)
    """Surfaces for drag and sunlight; `link` is the URDF's, or base for the satellite."""
    tools: list[str] | None = None
    """Links whose frames are tools, in order of rank; default: the ends of the branches."""

    @model_validator(mode="after")
    def _check_source(self) -> Self:
        if bool(self.urdf) == bool(self.urdf_text):
            raise ValueError("either urdf or urdf_text is needed, and not both")
        return self

    def read(self, folder: Path, where: str) -> UrdfRobot:
        """Read the URDF, with a path relative to ``folder``, and add what the YAML has."""
        if self.urdf:
            urdf = read_urdf(folder / self.urdf, self.base, self.repair, self.tools)
        else:
            path = folder / f"{self.name or 'robot'}.urdf"
            urdf = read_urdf(path, self.base, self.repair, self.tools, self.urdf_text)
        tree = urdf.tree
        joints = {link.joint_label: link for link in tree.links}
        moving = [name for name, link in joints.items() if link.moves]
        for name in self.passive:
            one_of(name, moving, "passive joint", f" of {where}")
        motors = [name for name in moving if name not in self.passive]
        for name in self.drives:
            if name not in motors:
                what = "a joint without a motor" if name in joints else "not a joint of the URDF"
                advice = choices(name, motors)
                raise InputError(f"{where}: robot.drives: {short(name)} is {what}: {advice}")
        links = [self._with_drive(link) for link in tree.links]
        return replace(
            urdf,
            tree=replace(
                tree, name=self.name or tree.name, links=links, plates=self._placed(urdf, where)
            ),
        )

    def _with_drive(self, link: Body) -> Body:
        name = link.joint_label
        if not (spring := self.passive.get(name)):
            return replace(link, drive=self.drives.get(name))
        friction = link.friction and link.friction._replace(viscous=0.0)  # the spring has it
        spring = spring.from_degrees(link.joint == "prismatic")
        return replace(link, passive=spring, friction=friction)

    def _placed(self, urdf: UrdfRobot, where: str) -> Plates:
        names = [urdf.tree.base.name, *(link.name for link in urdf.tree.links)]
        placed = []
        for number, plate in enumerate(self.plates):
            name = names[0] if plate.link == BASE and BASE not in names else plate.link
            if name not in names:
                key, advice = f"robot.plates.{number}.link", choices(name, names)
                raise InputError(f"{where}: {key}: no link {short(name)}: {advice}")
            frame = urdf.frames.get(name, IDENTITY)
            placed.append(moved(plate.normalised, frame.rotation.T, frame.inside, link=name))
        return placed


class _UrdfDocument(StrictModel):
    robot: UrdfReference


def is_urdf(content: dict[str, Any]) -> bool:
    """Return True if the content of a robot's YAML refers to a URDF."""
    robot = content.get("robot")
    return isinstance(robot, dict) and ("urdf" in robot or "urdf_text" in robot)


def read_content(content: dict[str, Any], folder: Path, where: str) -> RobotTree | UrdfRobot:
    """Read a robot's YAML, or the URDF that it refers to.

    Args:
        content: of the YAML.
        folder: of the YAML.
        where: name of the YAML, for errors.
    """
    if is_urdf(content):
        return validate(_UrdfDocument, content, where).robot.read(folder, where)
    return validate(RobotDocument, content, where).robot


def exact_document(tree: RobotTree) -> dict[str, Any]:
    """Return the mapping from which the same robot is built to the last bit."""
    return {"robot": _plain(tree)}


def _plain(value: Any, name: str = "") -> Any:
    if is_dataclass(value):
        parts = {f.name: _plain(getattr(value, f.name), f.name) for f in fields(value)}
        return {key: own for key, own in parts.items() if key != "body" and own not in ("", None)}
    if isinstance(value, np.ndarray):
        return (value.ravel() if name == "inertia" else value).tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(own) for own in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


def readable_document(tree: RobotTree) -> dict[str, Any]:
    """Return the mapping from which `Robot.from_dict` builds the same robot, of a flattened tree.

    Frames are written in degrees, so numbers may differ from the robot's in their last digits. The
    order of joints is kept.
    """
    carriers = {link.name: link.joint_label for link in tree.links} | {tree.base.name: BASE}
    links = sorted(tree.links, key=lambda link: link.passive is not None)
    robot: dict[str, Any] = {
        "name": tree.name,
        "base": {
            "mass": tree.base.mass,
            "inertia": plain_numbers(inertia_elements(tree.base.inertia)),
        },
        "links": [_link(link, carriers[link.parent]) for link in links],
        "tools": [
            {
                "name": tool.name,
                "link": carriers[tool.link],
                "origin": _origin(tool.rotation, tool.position),
            }
            for tool in tree.tools
        ],
    }
    for key, parts in (("plates", tree.plates), ("visuals", tree.visuals)):
        if parts:
            robot[key] = [_on_link(part, carriers[part.link]) for part in parts]
    return {"robot": robot}


def _link(link: Body, parent: str) -> dict[str, Any]:
    is_prismatic = link.joint == "prismatic"

    def number(value: float) -> float:
        return float(value if is_prismatic else np.degrees(value))

    entry: dict[str, Any] = {
        "name": link.joint_label,
        "parent": parent,
        "joint": link.joint,
        "origin": _origin(link.rotation, product(link.rotation, link.offset)),
        "mass": link.mass,
        "inertia": plain_numbers(inertia_elements(link.inertia)),
        "com": plain_numbers(link.com),
    }
    if link.friction:
        entry["friction"] = link.friction._asdict()
    lower, upper, velocity, effort = link.limits
    limits: dict[str, Any] = {}
    if math.isfinite(lower) and math.isfinite(upper):
        limits["position_deg"] = [number(lower), number(upper)]
    if math.isfinite(velocity):
        limits["velocity_deg"] = number(velocity)
    if math.isfinite(effort):
        limits["effort"] = float(effort)
    if limits:
        entry["limits"] = limits
    if link.drive:
        entry["drive"] = gear_document(link.drive)
    if link.passive:
        stiffness, damping, rest = link.passive
        rest = number(rest)
        entry["passive"] = {"stiffness": stiffness, "damping": damping, "rest_deg": rest}
    return entry


def gear_document(gear: Gear) -> dict[str, Any]:
    """Return a gear as in a file."""
    return {"gear_ratio" if key == "ratio" else key: own for key, own in gear._asdict().items()}


def _on_link(part: Plate | Visual, link: str) -> dict[str, Any]:
    entry: dict[str, Any] = {"link": link} | _plain(replace(part, link=""))
    if isinstance(part, Plate):
        return entry | {"normal": plain_numbers(part.normal), "centre": plain_numbers(part.centre)}
    del entry["rotation"], entry["position"]
    return entry | {"origin": _origin(part.rotation, part.position)}


def _origin(rotation: Array, position: Array) -> dict[str, Any]:
    return {
        "xyz": plain_numbers(position),
        "rpy_deg": plain_numbers(np.degrees(rpy_of_rotation(rotation))),
    }


def plain_numbers(values: Array) -> list[float]:
    """Return floats for a file."""
    # adding 0 makes negative zeros positive, which a reader would take for a sign
    return [float(value) + 0.0 for value in values]
