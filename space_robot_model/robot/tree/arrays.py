"""A tree of bodies as the arrays that the algorithms are filled from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_PASSIVE

from ...dynamics.model import MOST_JOINTS
from .bodies import Body, Joint, JointFriction, JointLimits, Spring, Tool, Visual
from .flatten import Moved, flatten

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TreeArrays:
    """A base with bodies in a tree, each moved by one joint: N joints, n with a motor.

    Arrays over joints list the n actuated ones first, then the passive ones, which have springs
    for motors; each group as a walk down each branch meets them. Body 0 is the base, body j + 1 the
    one that joint j moves; its frame has the joint's axis as z. The base's frame sits at its CoM.
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
    order: tuple[int, ...] = ()
    """All joints as a walk down each branch meets them: a parent's before its children's."""

    @property
    def n(self) -> int:
        """Number of actuated joints."""
        return len(self.joint_names)

    @property
    def joint_count(self) -> int:
        """Number N of all joints."""
        return len(self.joint_names) + len(self.passive_names)

    @property
    def branches(self) -> tuple[int, ...]:
        """Number of actuated joints in each branch on the base that has any, in their order."""
        counts: dict[int, int] = {}
        for joint in range(self.n):
            body = joint + 1
            while self.parent[body - 1]:
                body = int(self.parent[body - 1])
            counts[body] = counts.get(body, 0) + 1
        return tuple(counts.values())

    @property
    def all_joint_names(self) -> tuple[str, ...]:
        """Names of all N joints."""
        return self.joint_names + self.passive_names

    @property
    def tool(self) -> Tool:
        """The end effector."""
        return self.tools[0]

    @classmethod
    def of_tree(cls, name: str, bodies: Sequence[Body], where: str = "robot") -> Self:
        """Build from bodies in any order: see `space_robot_model.robot.tree.flatten`.

        Raises:
            InputError: they make no tree, or none that can be flown; ``where`` names the file.
        """
        walked = flatten(bodies, where)
        moved = sorted(walked[1:], key=lambda m: _joint(m).spring is not None)
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
        """Return the tree that `of_tree` makes this robot of, as a walk down each branch."""
        bodies = []
        for number in (0, *(joint + 1 for joint in self.order)):
            name = self.body_names[number]
            body = Body(
                name,
                float(self.mass[number]),
                self.inertia[number],
                self.com[number],
                tools=tuple(tool for tool in self.tools if tool.body == number),
                visuals=tuple(visual for visual in self.visuals if visual.body == number),
            )
            if number:
                j = number - 1
                passive = j - self.n
                joint = Joint(
                    self.all_joint_names[j],
                    "prismatic" if self.is_prismatic[j] else "revolute",
                    self.rotation[j],
                    self.offset[j],
                    limits=self.limits[j] if passive < 0 else JointLimits(),
                    friction=self.friction[j],
                    spring=self.springs[passive] if passive >= 0 else None,
                )
                body = replace(body, parent=self.body_names[self.parent[j]], joint=joint)
            bodies.append(body)
        return bodies


def _joint(moved: Moved) -> Joint:
    assert moved.body.joint
    return moved.body.joint


def _numbered_tools(members: Sequence[Body]) -> tuple[Tool, ...]:
    """Return the tools of all bodies; a robot without any has one on its last body."""
    numbered = [
        replace(tool, body=number) for number, body in enumerate(members) for tool in body.tools
    ]
    numbered = numbered or [Tool("tool", np.eye(3), np.zeros(3), len(members) - 1)]
    return tuple(sorted(numbered, key=lambda tool: tool.rank))
