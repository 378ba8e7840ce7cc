"""Exact numbers of a robot as a mapping, from which the same robot is built bit for bit.

Bags store robots without file in this form. Robots written by hand have the form of
`space_robot_model.robot.file`. Infinite numbers and NaN are null.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

from ..dynamics.model import MOST_JOINTS
from .inertia import LARGEST_MASS, InertiaElement
from .link_file import DriveFile, Vector, drive_of
from .tree import Body, Joint, JointFriction, JointLimits, Plate, Spring, Tool, Visual
from .visual_file import ShapeFile, shape_of

Array = NDArray[np.float64]
Matrix = Annotated[list[Vector], Field(min_length=3, max_length=3)]
InertiaRow = Annotated[list[InertiaElement], Field(min_length=3, max_length=3)]


class ToolNumbers(StrictModel):
    """Frame of an end effector: name, rotation, position and rank of a `Tool`."""

    name: str
    rotation: Matrix
    position: Vector
    rank: int


class JointNumbers(StrictModel):
    """A `Joint` about, or along, the z axis of its body."""

    name: str
    kind: Literal["revolute", "prismatic"]
    rotation: Matrix
    offset: Vector
    limits: Annotated[list[float | None], Field(min_length=4, max_length=4)]
    friction: Annotated[list[float | None], Field(min_length=2, max_length=2)]
    spring: Annotated[list[float], Field(min_length=3, max_length=3)] | None
    drive: DriveFile | None = None


class PlateNumbers(StrictModel):
    """A `Plate` of a body."""

    area: float
    normal: Vector
    centre: Vector
    drag_coefficient: float
    specular: float
    diffuse: float

    @property
    def plate(self) -> Plate:
        """Return the plate with these numbers."""
        return Plate(
            self.area,
            np.array(self.normal),
            np.array(self.centre),
            self.drag_coefficient,
            self.specular,
            self.diffuse,
        )


class VisualNumbers(ShapeFile):
    """A `Visual` of a body."""

    rotation: Matrix
    position: Vector


class BodyNumbers(StrictModel):
    """A rigid body with its joint, tools and surfaces, as a `Body`."""

    name: str
    mass: Annotated[float, Field(ge=0.0, le=LARGEST_MASS)]
    inertia: Annotated[list[InertiaRow], Field(min_length=3, max_length=3)]
    com: Vector
    parent: str
    joint: JointNumbers | None
    tools: list[ToolNumbers]
    plates: list[PlateNumbers] = Field([])
    visuals: list[VisualNumbers] = Field([])

    @property
    def body(self) -> Body:
        """Return the body with these numbers."""
        joint, own = None, self.joint
        if own:
            joint = Joint(
                own.name,
                own.kind,
                np.array(own.rotation),
                np.array(own.offset),
                limits=JointLimits(*_or(own.limits, JointLimits())),
                friction=JointFriction(*_or(own.friction, JointFriction())),
                spring=Spring(*own.spring) if own.spring else None,
                gear=own.drive.gear if own.drive else None,
            )
        tools = (
            Tool(t.name, np.array(t.rotation), np.array(t.position), rank=t.rank)
            for t in self.tools
        )
        return Body(
            self.name,
            self.mass,
            np.array(self.inertia),
            np.array(self.com),
            self.parent,
            joint,
            tuple(tools),
            visuals=tuple(
                shape.at(np.array(shape.rotation), np.array(shape.position))
                for shape in self.visuals
            ),
            plates=tuple(plate.plate for plate in self.plates),
        )


class RobotNumbers(StrictModel):
    """A robot's bodies, branch by branch from the base."""

    name: Annotated[str, Field(min_length=1)]
    bodies: Annotated[list[BodyNumbers], Field(min_length=2, max_length=MOST_JOINTS + 1)]


class Document(StrictModel):
    """The complete mapping."""

    robot: RobotNumbers


def are_numbers(content: dict[str, Any]) -> bool:
    """Return True if a robot's mapping has this form, and not that of a file."""
    robot = content.get("robot")
    return isinstance(robot, dict) and "bodies" in robot


def numbers_of(name: str, bodies: Sequence[Body]) -> dict[str, Any]:
    """Return the mapping of a robot's exact numbers, in the form of `Document`."""
    return {"robot": {"name": name, "bodies": [_body_numbers(body) for body in bodies]}}


def _body_numbers(body: Body) -> dict[str, Any]:
    """Return the numbers of a body, without validation, which would take too long."""
    joint = body.joint and {
        "name": body.joint.name,
        "kind": body.joint.kind,
        "rotation": body.joint.rotation.tolist(),
        "offset": body.joint.offset.tolist(),
        "limits": _known(body.joint.limits),
        "friction": _known(body.joint.friction),
        "spring": [float(v) for v in body.joint.spring] if body.joint.spring else None,
        **({"drive": drive_of(body.joint.gear)} if body.joint.gear else {}),
    }
    tools = [
        {
            "name": t.name,
            "rotation": t.rotation.tolist(),
            "position": t.position.tolist(),
            "rank": t.rank,
        }
        for t in body.tools
    ]
    return {
        "name": body.name,
        "mass": float(body.mass),
        "inertia": body.inertia.tolist(),
        "com": body.com.tolist(),
        "parent": body.parent,
        "joint": joint,
        "tools": tools,
        **({"plates": [_plate_numbers(plate) for plate in body.plates]} if body.plates else {}),
        **({"visuals": [_visual_numbers(shape) for shape in body.visuals]} if body.visuals else {}),
    }


def _visual_numbers(shape: Visual) -> dict[str, Any]:
    place = {"rotation": shape.rotation.tolist(), "position": shape.position.tolist()}
    return shape_of(shape) | place


def _plate_numbers(plate: Plate) -> dict[str, Any]:
    return {
        "area": float(plate.area),
        "normal": plate.normal.tolist(),
        "centre": plate.centre.tolist(),
        "drag_coefficient": float(plate.drag_coefficient),
        "specular": float(plate.specular),
        "diffuse": float(plate.diffuse),
    }


def _known(row: Sequence[float]) -> list[float | None]:
    return [float(value) if math.isfinite(value) else None for value in row]


def _or(row: list[float | None], default: Sequence[float]) -> list[float]:
    return [other if value is None else value for value, other in zip(row, default, strict=True)]
