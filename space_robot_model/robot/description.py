"""Description of a robot: bodies, joints, tools and shapes, for JSON and tables."""

from __future__ import annotations

import math
import os.path
from typing import Any

import numpy as np

from ..elementary.matrices import norms
from .files import gear_document, plain_numbers
from .parts import MANY_TURNS
from .robot import Robot
from .shapes import plates_of

FAR = 100.0
"""Distance between two joints that asks for a remark, m."""


def describe(robot: Robot) -> dict[str, Any]:
    """Return the parts of a robot in SI units; angles in rad, unknown numbers are infinite.

    Vectors are in the axes of the body's frame, whose z axis is that of its joint.
    """
    return {
        "name": robot.name,
        "mass": float(np.sum(robot.mass)),
        "joint_names": list(robot.joint_names),
        "passive_names": list(robot.passive_names),
        "bodies": [_body(robot, number) for number in range(robot.joint_count + 1)],
        "joints": [_joint(robot, number) for number in range(robot.joint_count)],
        "tools": [
            {
                "name": t.name,
                "body": robot.body_names[t.body],
                "position": plain_numbers(t.position),
            }
            for t in robot.tools
        ],
        "shapes": [
            {
                "body": robot.body_names[seen.body],
                "shape": seen.shape,
                "size": list(seen.size),
                **({"mesh": seen.mesh, "found": os.path.isfile(seen.mesh)} if seen.mesh else {}),
            }
            for seen in robot.visuals
        ],
        "plates": _plates(robot),
        "repairs": list(robot.repairs),
        "remarks": unit_remarks(robot),
    }


def unit_remarks(robot: Robot) -> list[str]:
    """Return remarks on numbers that look like millimetres or degrees, where m and rad are read."""
    remarks = []
    for joint, name in enumerate(robot.all_joint_names):
        if (distance := float(norms(robot.offset[joint]))) > FAR:
            remarks.append(
                f"joint {name!r} is {distance:.6g} m from the joint before it: lengths are in m"
            )
    for joint, (name, limits) in enumerate(zip(robot.joint_names, robot.limits, strict=True)):
        ends = [abs(end) for end in (limits.lower, limits.upper) if math.isfinite(end)]
        if not robot.is_prismatic[joint] and max(ends, default=0.0) > MANY_TURNS:
            remarks.append(
                f"joint {name!r} has a limit at {math.degrees(max(ends)):.6g} degrees "
                f"({max(ends):.6g} rad): angles of a URDF are in rad"
            )
    return remarks


def _body(robot: Robot, number: int) -> dict[str, Any]:
    return {
        "name": robot.body_names[number],
        "joint": robot.all_joint_names[number - 1] if number else None,
        "mass": float(robot.mass[number]),
        "com": plain_numbers(robot.com[number]),
        "inertia": [plain_numbers(row) for row in robot.inertia[number]],
        "principal_moments": plain_numbers(np.linalg.eigvalsh(robot.inertia[number])),
    }


def _joint(robot: Robot, number: int) -> dict[str, Any]:
    is_actuated = number < robot.n
    friction = robot.friction[number]
    entry: dict[str, Any] = {
        "name": robot.all_joint_names[number],
        "kind": "prismatic" if robot.is_prismatic[number] else "revolute",
        "is_actuated": is_actuated,
        "parent": robot.body_names[robot.parent[number]],
        "child": robot.body_names[number + 1],
        "friction": None if np.isnan(friction.coulomb) else friction._asdict(),
    }
    if is_actuated:
        gear = robot.gears[number] if robot.gears else None
        limits = robot.limits[number]._asdict()
        drive = gear and {**gear_document(gear), "reflected_inertia": gear.reflected_inertia}
        return {**entry, "limits": limits, **({"drive": drive} if gear else {})}
    return {**entry, "spring": robot.springs[number - robot.n]._asdict()}


def _plates(robot: Robot) -> dict[str, Any]:
    """Return number and area, m2, of the plates for drag and sunlight, by body and together."""
    areas: dict[str, list[float]] = {}
    for plate in plates_of(robot):
        areas.setdefault(robot.body_names[plate.body], []).append(float(plate.area))
    return {
        "source": "file" if robot.plates else "shapes",
        "count": sum(map(len, areas.values())),
        "area": math.fsum(area for own in areas.values() for area in own),
        "bodies": [
            {"name": name, "count": len(areas[name]), "area": math.fsum(areas[name])}
            for name in robot.body_names
            if name in areas
        ],
    }
