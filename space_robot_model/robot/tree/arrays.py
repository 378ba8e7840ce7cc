"""A tree of bodies as arrays, the input of the algorithms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_PASSIVE

from ...dynamics.model import MOST_JOINTS
from .bodies import Body, Gear, Joint, JointFriction, JointLimits, Plate, Spring, Tool, Visual
from .flatten import Moved, flatten

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TreeArrays:
    """A base with a tree of bodies, each moved by one joint: N joints, n of them actuated.

    Arrays over joints have the n actuated ones first, then the passive ones with springs; each
    group branch by branch from the base. Body 0 is the base, body j + 1 is moved by joint j; the z
    axis of its frame is the joint's axis. The base's frame is at its CoM, but for `Robot.nominal`.
    """

    name: str
    joint_names: tuple[str, ...]
    """Names of the n actuated joints, in the order of all arrays of the flight software."""
    passive_names: tuple[str, ...]
    body_names: tuple[str, ...]
    mass: Array
    """(N+1,) masses, kg, base first."""
    inertia: Array
    """(N+1, 3, 3) inertia about each body's CoM, kg m2, in its frame."""
    com: Array
    """(N+1, 3) centre of mass, m, in the body's frame."""
    parent: NDArray[np.int64]
    """(N,) number of the parent body of each joint."""
    rotation: Array
    """(N, 3, 3) axes of each joint's frame at zero, as columns, in parent axes."""
    offset: Array
    """(N, 3) from the parent's frame to the joint's, m, in the joint's axes at zero."""
    is_prismatic: NDArray[np.bool_]
    """(N,) True for prismatic joints, False for revolute ones."""
    limits: tuple[JointLimits, ...]
    """Limits of the n actuated joints."""
    friction: tuple[JointFriction, ...]
    """Friction of all N joints."""
    springs: tuple[Spring, ...]
    """Springs of the passive joints."""
    tools: tuple[Tool, ...]
    """Frames of the end effectors; the first one is *the* tool."""
    visuals: tuple[Visual, ...] = ()
    order: tuple[int, ...] = ()
    """Order of all joints branch by branch: parents before children."""
    gears: tuple[Gear | None, ...] = ()
    """Gears of the n actuated joints, None for rigid ones; empty: all are rigid."""
    plates: tuple[Plate, ...] = ()

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
        """Number of actuated joints in each branch with actuated joints, in order."""
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
    def geared_names(self) -> tuple[str, ...]:
        """Names of the joints with gears."""
        pairs = zip(self.joint_names, self.gears, strict=False)
        return tuple(name for name, gear in pairs if gear)

    @property
    def tool(self) -> Tool:
        """The end effector."""
        return self.tools[0]

    @classmethod
    def of_tree(
        cls, name: str, bodies: Sequence[Body], where: str = "robot", base_is_at_com: bool = True
    ) -> Self:
        """Build the arrays from bodies in any order, see `space_robot_model.robot.tree.flatten`.

        Raises:
            InputError: not a tree, or one that cannot be flown; ``where`` names the file.
        """
        walked = flatten(bodies, where, base_is_at_com)
        moved = sorted(walked[1:], key=lambda m: _joint(m).spring is not None)
        joints = [_joint(m) for m in moved]
        actuated = tuple(joint for joint in joints if not joint.spring)
        springs = tuple(joint.spring for joint in joints if joint.spring)
        gears = [joint.gear for joint in actuated]
        for number, most, what in (
            (len(joints), MOST_JOINTS, "moving joints"),
            (len(springs), MOST_PASSIVE, "passive joints"),
        ):
            if number > most:
                raise InputError(f"{where}: at most {most} {what} can be flown, got {number}")
        if not actuated:
            raise InputError(f"{where}: a robot needs at least one actuated joint")
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
            gears=tuple(gears) if any(gears) else (),
            plates=tuple(
                replace(plate, body=number)
                for number, body in enumerate(members)
                for plate in body.plates
            ),
        )

    def bodies(self) -> list[Body]:
        """Return the bodies from which `of_tree` builds this robot, branch by branch."""
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
                plates=tuple(plate for plate in self.plates if plate.body == number),
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
                    gear=self.gears[j] if passive < 0 and self.gears else None,
                )
                body = replace(body, parent=self.body_names[self.parent[j]], joint=joint)
            bodies.append(body)
        return bodies


def _joint(moved: Moved) -> Joint:
    assert moved.body.joint
    return moved.body.joint


def _numbered_tools(members: Sequence[Body]) -> tuple[Tool, ...]:
    """Return the tools of all bodies; without any, one on the last body."""
    numbered = [
        replace(tool, body=number) for number, body in enumerate(members) for tool in body.tools
    ]
    numbered = numbered or [Tool("tool", np.eye(3), np.zeros(3), len(members) - 1)]
    return tuple(sorted(numbered, key=lambda tool: tool.rank))
