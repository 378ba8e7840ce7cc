"""Variables of the plant's robot: masses, inertias, centres of mass, friction, springs, gears."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from space_robot_model.elementary.functions import exp
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.validation import StrictModel, one_of, validate
from space_robot_msgs_py.errors import InputError

from .changes import Changes
from .distributions import Normal, Value
from .drive_variables import OF_DRIVES, OF_PLATES, drive_variables, plate_variables
from .names import NamePart, chosen
from .robot_numbers import OfRobot, read_not_negative, read_number, read_positive
from .variable import Variable

OF_BODIES = ("mass", "inertia", "com")
OF_JOINTS = ("friction.coulomb", "friction.viscous", "stiffness", "damping", *OF_DRIVES)
GROUPS = ("base", "links", "joints", "plates")
ALLOWED = {"joints": OF_JOINTS, "plates": OF_PLATES}
XYZ = ("x", "y", "z")


@dataclass(frozen=True)
class Mass(OfRobot):
    """Mass of a body, kg."""

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "mass", self.body

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        mass = changes.robot.mass
        mass[self.body] = self.distribution.on(float(mass[self.body]), value)


@dataclass(frozen=True)
class InertiaScale(OfRobot):
    """Factor of a body's inertia tensor."""

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "inertia", self.body

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        changes.robot.inertia[self.body] *= float(value)


@dataclass(frozen=True)
class InertiaSpread(OfRobot):
    """One of the six arguments of `spread`: log factors 0 to 2, rotations 3 to 5, degrees."""

    number: int

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "inertia", self.body, self.number

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        own = changes.robot.spreads[self.body]
        if self.number < 3:
            own.factors[self.number] = exp(float(value))
        else:
            own.turn[self.number - 3] = float(value) * (math.pi / 180.0)


@dataclass(frozen=True)
class CentreOfMass(OfRobot):
    """Coordinate of a body's centre of mass along an axis of the body's frame, m."""

    axis: int

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "com", self.body, self.axis

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        com = changes.robot.com[self.body]
        com[self.axis] = self.distribution.on(float(com[self.axis]), value)


@dataclass(frozen=True)
class OfJoint(OfRobot):
    """Friction of a joint, or spring constant or damping of a passive one."""

    field: str

    @property
    def place(self) -> Hashable:
        """Return the key of the changed quantity."""
        return "joint", self.body, self.field

    def apply(self, value: Value, changes: Changes) -> None:
        """Apply a value of the variable to a flight."""
        robot, joint = changes.robot, self.body - 1
        word, _, field = self.field.rpartition(".")
        if word == "friction":
            old = robot.friction[joint]
            number = self.distribution.on(getattr(old, field), value)
            robot.friction[joint] = old._replace(**{field: number})
        else:
            passive = joint - robot.nominal.n
            spring = robot.springs[passive]
            number = self.distribution.on(getattr(spring, field), value)
            robot.springs[passive] = spring._replace(**{field: number})


class SpreadFile(StrictModel):
    """Entry ``{scale: 0.1, rotate_deg: 3}`` of an inertia."""

    scale: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    """Standard deviation of the logarithms of the second moments' factors."""
    rotate_deg: Annotated[float, Field(gt=0.0, le=30.0)] | None = None
    """Standard deviation of the rotation about each axis, degrees."""


def robot_variables(
    key: str, parts: list[NamePart], value: Any, where: str, robot: Robot
) -> Sequence[Variable]:
    """Return the variables of ``robot.*``.

    Args:
        key: of ``vary``.
        parts: of the key, without ``robot``.
        value: of the key.
        where: file and key, for errors.
        robot: the nominal one.

    Raises:
        InputError: the robot has no such parameter, or the parameter cannot have such values.
    """
    group = one_of(parts[0].word if parts else "", GROUPS, "part of the robot")
    what = ".".join(part.word for part in parts[1:])
    allowed = ALLOWED.get(group, OF_BODIES)
    one_of(what, allowed, f"number of robot.{group}{'' if group == 'base' else '[...]'}")
    if what != "com" and any(part.element for part in parts[1:]):
        raise InputError(f"{what} has no elements")
    if group == "plates":
        return plate_variables(key, what, parts[0].element, value, where, robot)
    if group == "base":
        if parts[0].element:
            raise InputError(f"there is only one base: robot.base.{what}")
        bodies = [(0, "robot.base")]
    else:
        if not parts[0].element:
            raise InputError(f"an element is missing: robot.{group}[*].{what}, or [NAME]")
        if what in OF_DRIVES:
            return drive_variables(key, what, parts[0].element, value, where, robot)
        names = robot.body_names[1:] if group == "links" else robot.all_joint_names
        kind = group.rstrip("s")
        bodies = [
            (number + 1, f"robot.{group}[{name}]")
            for number, name in _chosen(parts[0].element, names, robot, kind)
        ]
    if group == "joints":
        return [
            _of_joint(f"{name}.{what}", key, value, where, robot, body, what)
            for body, name in bodies
        ]
    if what == "com":
        if not parts[-1].element:
            raise InputError(f"the axis is missing: {key}[x], [y], [z] or [*]")
        distribution = read_number(value, where)
        return [
            CentreOfMass(f"{name}.com[{axis_name}]", key, distribution, body, axis)
            for body, name in bodies
            for axis, axis_name in chosen(parts[-1].element, XYZ, "axis")
        ]
    if what == "mass":
        return [
            Mass(f"{name}.mass", key, read_positive(value, where, float(robot.mass[body])), body)
            for body, name in bodies
        ]
    return [
        variable
        for body, name in bodies
        for variable in _of_inertia(f"{name}.inertia", key, value, where, body)
    ]


def _chosen(element: str, names: tuple[str, ...], robot: Robot, what: str) -> list[tuple[int, str]]:
    if element not in names and element in robot.all_joint_names:  # a link by its joint's name
        return [(number := robot.all_joint_names.index(element), names[number])][:1]
    return chosen(element, names, what)


def _of_inertia(name: str, key: str, value: Any, where: str, body: int) -> list[OfRobot]:
    if isinstance(value, dict) and {"scale", "rotate_deg"} & value.keys():
        spread = validate(SpreadFile, value, where)
        factors = [
            InertiaSpread(
                f"{name}.scale_{i + 1}", key, Normal(normal=0.0, sigma=spread.scale), body, i
            )
            for i in range(3)
            if spread.scale
        ]
        turns = [
            InertiaSpread(
                f"{name}.rotate_{XYZ[i]}",
                key,
                Normal(normal=0.0, sigma=spread.rotate_deg),
                body,
                3 + i,
            )
            for i in range(3)
            if spread.rotate_deg
        ]
        return [*factors, *turns]
    distribution = read_positive(value, where, 1.0)
    if not distribution.relative:
        raise InputError(f"{where}: a factor of an inertia needs relative: true")
    return [InertiaScale(name, key, distribution, body)]


def _of_joint(
    name: str, key: str, value: Any, where: str, robot: Robot, body: int, what: str
) -> OfRobot:
    joint = body - 1
    if what.startswith("friction"):
        nominal = getattr(robot.friction[joint], what.partition(".")[2])
        if np.isnan(nominal):
            raise InputError(
                f"the robot's file has no friction of joint {robot.all_joint_names[joint]}, the "
                f"case has: vary plant.{what}"
            )
    elif joint < robot.n:
        raise InputError(f"joint {robot.all_joint_names[joint]} has a motor and no spring")
    else:
        nominal = getattr(robot.springs[joint - robot.n], what)
    return OfJoint(name, key, read_not_negative(value, where, nominal), body, what)
