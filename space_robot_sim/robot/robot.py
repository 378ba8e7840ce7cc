"""The robot is data: its numbers from YAML or URDF, checked for physical sense."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.config.validation import read_yaml, validate
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_PASSIVE
from space_robot_msgs_py.topics import BASE_AXES

from ..dynamics.model import MOST_JOINTS, Model
from .file import _Document, inertia_tensor
from .model import model_of
from .numbers import Document, are_numbers, numbers_of
from .tree import Body, Joint, JointFriction, JointLimits, Moved, Spring, Tool, Visual, flatten

if TYPE_CHECKING:
    from .urdf import UrdfRobot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Robot:
    """A satellite base with bodies in a tree, each moved by one joint: N joints, n with a motor.

    Arrays over joints list the n actuated ones first, then the passive ones, which have springs
    for motors; each group is in the order of the file. Body 0 is the base, body j + 1 the one that
    joint j moves; its frame has the joint's axis as z. The base's frame sits at its CoM.
    """

    name: str
    joint_names: tuple[str, ...]
    """Those of the n actuated joints: the order of all arrays that the flight software has."""
    passive_names: tuple[str, ...]
    body_names: tuple[str, ...]
    mass: Array
    """(N+1,) kg, base first."""
    inertia: Array
    """(N+1, 3, 3) kg m2 about each body's CoM, in its frame."""
    com: Array
    """(N+1, 3) m, in the body's frame."""
    parent: NDArray[np.int64]
    """(N,) the body that each joint moves against, by number."""
    rotation: Array
    """(N, 3, 3) axes of each joint's frame at zero, as columns, on the axes of the parent."""
    offset: Array
    """(N, 3) m, from the parent's frame to the joint's, on the joint's axes at zero."""
    is_prismatic: NDArray[np.bool_]
    """(N,) True for a joint that slides along its axis, False for one that turns about it."""
    limits: tuple[JointLimits, ...]
    """Of the n actuated joints."""
    friction: tuple[JointFriction, ...]
    """Of all N joints."""
    springs: tuple[Spring, ...]
    """Of the passive joints."""
    tools: tuple[Tool, ...]
    """Frames of the end effectors; the first one is *the* tool."""
    visuals: tuple[Visual, ...] = ()
    order: tuple[int, ...] = field(default=())
    """The joints as a walk down each branch meets them: a parent's before its children's."""
    repairs: tuple[str, ...] = ()
    """What was repaired in the file that it was read from, a line each."""

    @property
    def n(self) -> int:
        """Number of actuated joints."""
        return len(self.joint_names)

    @property
    def joint_count(self) -> int:
        """Number N of all joints."""
        return len(self.joint_names) + len(self.passive_names)

    @property
    def all_joint_names(self) -> tuple[str, ...]:
        """Names of all N joints."""
        return self.joint_names + self.passive_names

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of the n+3 controlled coordinates: base x, y, z, then the actuated joints."""
        return BASE_AXES + self.joint_names

    @property
    def tool(self) -> Tool:
        """The end effector."""
        return self.tools[0]

    @classmethod
    def from_yaml(cls, path: str | Path) -> Robot:
        """Read and check a robot file.

        Raises:
            InputError: naming file, key, value given and values allowed.
        """
        return cls.from_dict(read_yaml(Path(path)), str(path), Path(path).parent)

    @classmethod
    def from_dict(
        cls, content: dict[str, Any], where: str = "robot", folder: Path | None = None
    ) -> Robot:
        """Build from the mapping a robot file holds (key ``robot`` at its top), or `content`.

        A URDF that it refers to is looked for in ``folder``, the working one if None.
        """
        from .urdf_file import is_urdf, read_urdf_content

        if is_urdf(content):
            return cls._of_urdf(read_urdf_content(content, folder or Path(), where), where)
        if are_numbers(content):
            numbers = validate(Document, content, where).robot
            built = cls.of_tree(numbers.name, [b.body for b in numbers.bodies], where)
            return built._walked(numbers.order, where)
        file = validate(_Document, content, where).robot
        return cls.of_tree(file.name, file.bodies(), where)

    @classmethod
    def from_urdf(cls, path: str | Path, base: str | None = None, repair: bool = False) -> Robot:
        """Read and check a URDF or xacro file: see `space_robot_sim.robot.urdf.read_urdf`.

        Raises:
            InputError: in one line that names link or joint, line, value and the repair, if any.
        """
        from .urdf import read_urdf

        return cls._of_urdf(read_urdf(path, base, repair), str(path))

    @classmethod
    def _of_urdf(cls, found: UrdfRobot, where: str) -> Robot:
        robot = cls.of_tree(found.name, found.bodies, where)
        return replace(robot, repairs=tuple(map(str, found.findings)))

    @classmethod
    def of_tree(cls, name: str, bodies: Sequence[Body], where: str = "robot") -> Robot:
        """Build from bodies in any order: see `space_robot_sim.robot.tree.flatten`.

        Raises:
            InputError: they make no tree, or none that can be flown; ``where`` names the file.
        """
        walked = flatten(bodies, where)
        listed = {body.joint.name: number for number, body in enumerate(bodies) if body.joint}
        moved = sorted(
            walked[1:], key=lambda m: (_joint(m).spring is not None, listed[_joint(m).name])
        )
        joints = [_joint(m) for m in moved]
        actuated = tuple(joint for joint in joints if not joint.spring)
        springs = tuple(joint.spring for joint in joints if joint.spring)
        for number, most, what in (
            (len(joints), MOST_JOINTS, "moving joints"),
            (len(springs), MOST_PASSIVE, "passive joints"),
        ):
            if number > most:
                raise InputError(f"{where}: at most {most} {what} can be flown, here are {number}")
        if not actuated:
            raise InputError(f"{where}: a robot needs one actuated joint at least")
        all_moved = [walked[0], *moved]
        number_of = {id(m): number for number, m in enumerate(all_moved)}
        members = [m.body for m in all_moved]
        return cls(
            name,
            tuple(joint.name for joint in actuated),
            tuple(joint.name for joint in joints[len(actuated) :]),
            tuple(body.name for body in members),
            mass=np.array([body.mass for body in members]),
            inertia=np.array([body.inertia for body in members]),
            com=np.array([body.com for body in members]),
            parent=np.array([number_of[id(walked[m.parent])] for m in moved]),
            rotation=np.array([joint.rotation for joint in joints]),
            offset=np.array([joint.offset for joint in joints]),
            is_prismatic=np.array([joint.kind == "prismatic" for joint in joints]),
            limits=tuple(joint.limits for joint in actuated),
            friction=tuple(joint.friction for joint in joints),
            springs=springs,
            tools=_numbered_tools(members),
            visuals=tuple(
                replace(visual, body=number)
                for number, body in enumerate(members)
                for visual in body.visuals
            ),
            order=tuple(number_of[id(m)] - 1 for m in walked[1:]),
        )

    def bodies(self) -> list[Body]:
        """Return the tree that `of_tree` makes this robot of."""
        found = []
        for number, name in enumerate(self.body_names):
            body = Body(
                name, float(self.mass[number]), self.inertia[number], self.com[number],
                tools=tuple(tool for tool in self.tools if tool.body == number),
                visuals=tuple(visual for visual in self.visuals if visual.body == number),
            )  # fmt: skip
            if number:
                j = number - 1
                passive = j - self.n
                joint = Joint(
                    self.all_joint_names[j], "prismatic" if self.is_prismatic[j] else "revolute",
                    self.rotation[j], self.offset[j],
                    limits=self.limits[j] if passive < 0 else JointLimits(),
                    friction=self.friction[j],
                    spring=self.springs[passive] if passive >= 0 else None,
                )  # fmt: skip
                body = replace(body, parent=self.body_names[self.parent[j]], joint=joint)
            found.append(body)
        return found

    @property
    def content(self) -> dict[str, Any]:
        """All numbers but the visuals, as lists and texts; `from_dict` builds the same of them."""
        return numbers_of(self.name, self.bodies(), self.order)

    def _walked(self, order: Sequence[int], where: str) -> Robot:
        """Return the robot with another `order`, in which sums over branches are taken."""
        seen = {-1}
        for j in order:
            if j in seen or not 0 <= j < self.joint_count or self.parent[j] - 1 not in seen:
                raise InputError(f"{where}: order: each joint once, a parent's before its own")
            seen.add(j)
        if len(order) != self.joint_count:
            raise InputError(f"{where}: order: {self.joint_count} joints were expected")
        return replace(self, order=tuple(order))

    @cached_property
    def nominal(self) -> Robot:
        """The robot that the flight software knows: its passive joints are locked at rest."""
        if not self.springs:
            return self
        bodies = self.bodies()
        for number, body in enumerate(bodies):
            if body.joint and body.joint.spring:
                bodies[number] = replace(body, joint=_locked(body.joint, body.joint.spring.rest))
        return Robot.of_tree(self.name, bodies)

    def from_degrees(self, values: ArrayLike) -> Array:
        """Return positions of the n actuated joints in rad, and m of prismatic ones, as given.

        ``values`` (..., n) are in degrees, and in m of prismatic joints.
        """
        given, n = np.asarray(values, dtype=np.float64), self.n
        return np.where(self.is_prismatic[:n], given, np.radians(given))

    def to_degrees(self, values: ArrayLike) -> Array:
        """Invert `from_degrees`."""
        given, n = np.asarray(values, dtype=np.float64), self.n
        return np.where(self.is_prismatic[:n], given, np.degrees(given))

    def with_last_link(self, mass: float, inertia: list[float]) -> Robot:
        """Return the robot with a payload on the body that carries the tool, CoM kept.

        Args:
            mass: mass of that body, kg.
            inertia: ``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]`` about its CoM on its axes, kg m2.
        """
        masses, tensors, last = self.mass.copy(), self.inertia.copy(), self.tool.body
        masses[last], tensors[last] = mass, inertia_tensor(inertia)
        return replace(self, mass=masses, inertia=tensors)

    @cached_property
    def model(self) -> Model:
        """The numbers in the form the compiled algorithms read."""
        return model_of(self)


def _joint(moved: Moved) -> Joint:
    assert moved.body.joint
    return moved.body.joint


def _locked(joint: Joint, position: float) -> Joint:
    """Return the fixed joint that this one is at ``position``, rad or m."""
    offset, rotation = joint.offset, joint.rotation
    if joint.kind == "prismatic":
        offset = offset + np.array([0.0, 0.0, position])
    else:
        c, s = np.cos(position), np.sin(position)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        offset, rotation = turn.T @ offset, rotation @ turn
    return Joint(joint.name, "fixed", rotation, offset)


def _numbered_tools(members: Sequence[Body]) -> tuple[Tool, ...]:
    """Return the tools of all bodies; a robot without any has one on its last body."""
    found = [
        replace(tool, body=number)
        for number, body in enumerate(members)
        for tool in body.tools
    ]  # fmt: skip
    found = found or [Tool("tool", np.eye(3), np.zeros(3), len(members) - 1)]
    return tuple(sorted(found, key=lambda tool: tool.rank))
