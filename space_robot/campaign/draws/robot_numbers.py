"""The numbers of the plant's robot that can be varied: as a tree, and put into a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from space_robot_model.elementary.functions import exp
from space_robot_model.elementary.linear_algebra import principal_axes
from space_robot_model.elementary.matrices import Array, product, rotate_tensor
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Plate
from space_robot_model.robot.shapes import plates_of
from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.errors import InputError

from .paths import Elements, Path, Unavailable, value_at

XYZ = ("x", "y", "z")
LOG_FACTORS = tuple(f"scale_{number}" for number in (1, 2, 3))
"""Logarithms of the factors of an inertia's second moments, in ascending order of these."""
ROTATIONS = tuple(f"rotate_{axis}" for axis in XYZ)
"""Rotations of an inertia about the body's axes, degrees."""
GEAR_FIELDS = {
    "rotor_inertia": "rotor_inertia",
    "gear_ratio": "ratio",
    "stiffness": "stiffness",
    "damping": "damping",
}
"""Fields of a `Gear` by their names in files."""
PLATE_FIELDS = ("area", "drag_coefficient", "specular", "diffuse")

LEAST = 0.01
"""Lower bound of positive quantities, as a factor of the nominal ones."""


def robot_tree(robot: Robot, plates: Sequence[Plate] | None = None) -> Tree:
    """Return the numbers of a robot that can be varied; an inertia is a factor of the tensor.

    ``plates``: in place of those of the robot's shapes.
    """
    bodies = [
        {"mass": mass, "inertia": 1.0, "com": Elements(dict(zip(XYZ, com, strict=True)))}
        for mass, com in zip(robot.mass.tolist(), robot.com.tolist(), strict=True)
    ]
    joints = robot.all_joint_names
    plates = plates_of(robot) if plates is None else plates
    plate_numbers = {
        str(number): {field: getattr(plate, field) for field in PLATE_FIELDS}
        for number, plate in enumerate(plates, 1)
    }
    return {
        "base": bodies[0],
        "links": Elements(dict(zip(robot.body_names[1:], bodies[1:], strict=True)), joints),
        "joints": Elements({name: _joint(robot, joint) for joint, name in enumerate(joints)}),
        "plates": Elements(plate_numbers, default="all"),
    }


def _joint(robot: Robot, joint: int) -> Tree:
    name = robot.all_joint_names[joint]
    friction: Tree = {
        field: Unavailable(
            f"the robot's file has no friction of joint {name}, the case has: vary "
            f"plant.friction.{field}"
        )
        if np.isnan(number)
        else number
        for field, number in robot.friction[joint]._asdict().items()
    }
    gear = robot.gears[joint] if robot.gears else None
    drive: Any = {own: getattr(gear, field) for own, field in GEAR_FIELDS.items()} if gear else {}
    if not gear:
        geared = ", ".join(robot.geared_names) or "none"
        drive = Unavailable(f"joint {name} has no gear; joints with gears: {geared}")
    if joint >= robot.n:
        spring = robot.springs[joint - robot.n]
        springs: Tree = {"stiffness": spring.stiffness, "damping": spring.damping}
    else:
        springs = dict.fromkeys(
            ("stiffness", "damping"), Unavailable(f"joint {name} has a motor and no spring")
        )
    return {"friction": friction, **springs, "drive": drive}


def least_factor(path: Path) -> float | None:
    """Return the smallest allowed part of a robot's nominal number; None: any number is allowed."""
    if "com" in path:
        return None
    positive = ("mass", "inertia", "area", "rotor_inertia", "gear_ratio")
    return LEAST if path[-1] in positive or path[-2:] == ("drive", "stiffness") else 0.0


def is_always_consistent(path: Path) -> bool:
    """Return True if the plant can fly with every allowed value of a robot's number."""
    return "plates" not in path and "drive" not in path


def robot_with(robot: Robot, numbers: Mapping[Path, float], has_surfaces: bool) -> Robot:
    """Return a robot with other numbers, by path in its `robot_tree`.

    ``has_surfaces``: the plates derived from the nominal robot's shapes stay as they are.
    """
    is_lit = has_surfaces or any(part == "plates" for part, *_ in numbers)
    tree = robot_tree(robot, plates := plates_of(robot) if is_lit else ())
    for (*inner, name), value in numbers.items():
        if inner[-1] == "inertia":
            value_at(tree, tuple(inner[:-1])).setdefault("spread", {})[name] = float(value)
        else:
            value_at(tree, tuple(inner))[name] = value
    bodies, joints = [tree["base"], *tree["links"].values()], [*tree["joints"].values()]
    com = np.array([[*body["com"].values()] for body in bodies])
    inertia = robot.inertia * np.array([[[body["inertia"]]] for body in bodies])
    for body, own in enumerate(bodies):
        if arguments := own.get("spread"):
            factors = [exp(arguments.get(name, 0.0)) for name in LOG_FACTORS]
            turn = [arguments.get(name, 0.0) * (math.pi / 180.0) for name in ROTATIONS]
            inertia[body] = spread(inertia[body], factors, turn)
    varied = zip(plates, tree["plates"].values(), strict=True)
    plates = tuple(replace(plate, **own) for plate, own in varied)
    _check_shares(plates)
    shift = -com[0]
    changed = replace(
        robot,
        mass=np.array([body["mass"] for body in bodies], float),
        inertia=inertia,
        com=com,
        friction=tuple(
            own._replace(**{k: x for k, x in joint["friction"].items() if not isinstance(x, str)})
            for own, joint in zip(robot.friction, joints, strict=True)
        ),
        springs=tuple(
            own._replace(stiffness=joint["stiffness"], damping=joint["damping"])
            for own, joint in zip(robot.springs, joints[robot.n :], strict=True)
        ),
        gears=tuple(
            gear and gear._replace(**{GEAR_FIELDS[k]: v for k, v in joint["drive"].items()})
            for gear, joint in zip(robot.gears, joints, strict=False)
        ),
        plates=plates or robot.plates,
    )
    return _with_base_moved(changed, shift) if shift.any() else changed


def _check_shares(plates: Sequence[Plate]) -> None:
    for number, plate in enumerate(plates, 1):
        if plate.specular + plate.diffuse > 1.0 + 1e-12:
            raise InputError(
                f"plate {number}: specular {plate.specular:g} and diffuse {plate.diffuse:g} are "
                "shares of the same light: their sum must be at most 1"
            )


def _with_base_moved(robot: Robot, shift: Array) -> Robot:
    # everything on the base moves: the base's frame stays at its CoM
    offset, com = robot.offset.copy(), robot.com.copy()
    com[0] = 0.0
    for joint in np.flatnonzero(robot.parent == 0):
        # no BLAS, whose last digits depend on the processor
        offset[joint] += np.sum(robot.rotation[joint].T * shift, axis=1)
    tools = tuple(t if t.body else replace(t, position=t.position + shift) for t in robot.tools)
    visuals = tuple(v if v.body else replace(v, position=v.position + shift) for v in robot.visuals)
    plates = tuple(p if p.body else replace(p, centre=p.centre + shift) for p in robot.plates)
    return replace(robot, com=com, offset=offset, tools=tools, visuals=visuals, plates=plates)


def rotation(turn: ArrayLike) -> Array:
    """Return the rotation matrix (3, 3) of a Cayley vector: angle ``2 atan(|turn| / 2)``, rad."""
    x, y, z = 0.5 * np.asarray(turn, dtype=np.float64)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    scale = 2.0 / (1.0 + (x * x + y * y + z * z))
    result: Array = np.eye(3) + scale * (cross + product(cross, cross))
    return result


def spread(inertia: Array, factors: ArrayLike, turn: ArrayLike) -> Array:
    """Scale the principal second moments of mass of an inertia, and rotate it.

    The second moments ``tr(I)/2 E - I`` of a body are positive semidefinite. Positive factors along
    their principal axes keep them so, hence the result is physically consistent for all factors.

    Args:
        inertia: (3, 3) kg m2, about the centre of mass.
        factors: (3,) above 0, of the second moments in ascending order.
        turn: (3,) rad, see `rotation`.

    Returns:
        (3, 3) kg m2.
    """
    moments, axes = principal_axes(0.5 * _trace(inertia) * np.eye(3) - inertia)
    # some are 0 for a plate or a rod, and may be negative by rounding
    scaled = np.maximum(moments, 0.0) * np.asarray(factors, dtype=np.float64)
    second = rotate_tensor(product(rotation(turn), axes), np.diag(scaled))
    return _trace(second) * np.eye(3) - 0.5 * (second + second.T)


def _trace(matrix: Array) -> float:
    return float(matrix[0, 0] + matrix[1, 1] + matrix[2, 2])
