"""A robot as the mapping of a self-contained YAML file, for any source of the robot."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..elementary.matrices import product
from ..elementary.rotations import rpy_of_rotation
from .file import BASE
from .inertia import inertia_elements
from .robot import Robot

Array = NDArray[np.float64]


def document_of(robot: Robot) -> dict[str, Any]:
    """Return the mapping from which `Robot.from_dict` builds the same robot, without visuals.

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
        return link
    spring = robot.springs[joint - robot.n]
    rest = spring.rest if is_prismatic else float(np.degrees(spring.rest))
    link["passive"] = {"stiffness": spring.stiffness, "damping": spring.damping, "rest_deg": rest}
    return link


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
