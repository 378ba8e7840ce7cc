"""Robots in files: a YAML with their parts, a URDF, or a YAML that refers to a URDF."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import Field, model_validator
from typing_extensions import Self

from space_robot_msgs_py.config.choices import choices
from space_robot_msgs_py.config.validation import StrictModel, one_of, read_yaml, short, validate
from space_robot_msgs_py.config.yaml_text import parse_yaml, read_file
from space_robot_msgs_py.errors import InputError

from ..elementary.matrices import product
from ..elementary.rotations import rpy_of_rotation
from .inertia import inertia_elements
from .names import BASE
from .parts import Drive, Gear, Link, Name, Part, Plate, Plates, RobotTree, Spring, Visual
from .robot import Robot
from .urdf import HERE, UrdfRobot, parse_urdf, read_urdf

YAML, URDF = (".yaml", ".yml"), (".urdf", ".xacro")

Array = NDArray[np.float64]


class RobotDocument(StrictModel):
    """A robot's YAML."""

    robot: RobotTree


@dataclass(frozen=True, kw_only=True)
class UrdfReference(Part):
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

    def _with_drive(self, link: Link) -> Link:
        """Return a link with its spring or drive."""
        name = link.joint_label
        if not (spring := self.passive.get(name)):
            return replace(link, drive=self.drives.get(name))
        friction = link.friction and link.friction._replace(viscous=0.0)  # the spring has it
        spring = spring.from_degrees(link.joint == "prismatic")
        return replace(link, passive=spring, friction=friction)

    def _placed(self, urdf: UrdfRobot, where: str) -> Plates:
        """Return the plates in the axes of the bodies."""
        names = [urdf.tree.base.name, *(link.name for link in urdf.tree.links)]
        placed = []
        for number, plate in enumerate(self.plates):
            name = names[0] if plate.link == BASE and BASE not in names else plate.link
            if name not in names:
                key, advice = f"robot.plates.{number}.link", choices(name, names)
                raise InputError(f"{where}: {key}: no link {short(name)}: {advice}")
            frame, own = urdf.frames.get(name, HERE), plate.normalised
            normal = product(frame.rotation.T, own.normal)
            centre = product(frame.rotation.T, own.centre - frame.position)
            placed.append(replace(own, link=name, normal=normal, centre=centre))
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

    Raises:
        InputError: the YAML or the URDF is invalid.
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
            **({"plates": plates} if (plates := _on_links(robot.plates, carriers)) else {}),
            **({"visuals": visuals} if (visuals := _on_links(robot.visuals, carriers)) else {}),
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
            link["drive"] = gear_document(gear)
        return link
    spring = robot.springs[joint - robot.n]
    rest = spring.rest if is_prismatic else float(np.degrees(spring.rest))
    link["passive"] = {"stiffness": spring.stiffness, "damping": spring.damping, "rest_deg": rest}
    return link


def gear_document(gear: Gear) -> dict[str, Any]:
    """Return a gear as in a file."""
    return {"gear_ratio" if key == "ratio" else key: own for key, own in gear._asdict().items()}


def _on_links(parts: Sequence[Plate | Visual], carriers: Sequence[str]) -> list[dict[str, Any]]:
    """Return plates or visuals as in a file."""
    entries = []
    for part in parts:
        entry = {"link": carriers[part.body]} | _plain(replace(part, link=""))
        if isinstance(part, Visual):
            del entry["rotation"], entry["position"]
            entry["origin"] = _origin(part.rotation, part.position)
        else:
            entry |= {"normal": _numbers(part.normal), "centre": _numbers(part.centre)}
        entries.append(entry)
    return entries


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
