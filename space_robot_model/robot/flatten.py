"""Conversion of a robot's parts to the arrays of the algorithms.

Links on fixed joints are merged into their parents, every joint axis is the z axis of its body's
frame, and the base's frame is at its centre of mass.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_PASSIVE

from ..dynamics.model import MOST_JOINTS
from ..elementary.matrices import Array, norm, product, rotate_tensor
from .names import first_repeated, other_meaning
from .parts import Base, Body, JointFriction, Part, Plate, RobotTree, Tool, Visual, moved

SETTINGS_FRICTION = JointFriction(np.nan, np.nan)


@dataclass
class MovedBody:
    """A rigid body of the flattened tree; its frame has the joint as z axis."""

    name: str
    parent: int
    """Number of the parent; the base is 0."""
    joint: Body | None
    """With the frame of the joint at position zero; None for the base."""
    mass: float = 0.0
    com: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    members: list[tuple[float, Array, Array]] = field(default_factory=list)
    """Mass, centre of mass and inertia of all links that are fixed to one another."""


@dataclass(frozen=True)
class Place:
    """Frame of a link in that of the body that carries it."""

    body: int
    rank: int
    """Number of the link on the way outwards."""
    rotation: Array
    position: Array
    shift: Array | None = None
    """Of the body's frame afterwards: added last, so that no bit depends on it being zero."""

    def at(self, vector: Array) -> Array:
        """Return a position (3,) on the link in the axes of the body."""
        at = self.position + product(self.rotation, vector)
        return at if self.shift is None else self.shift + at


def robot_arrays(tree: RobotTree, where: str = "robot") -> dict[str, Any]:
    """Return the fields of a `Robot`.

    Joints come branch by branch in the order of ``tree.links``, parents before children, the
    actuated ones before the passive ones.

    Args:
        tree: links in any order.
        where: name of the file, for errors.

    Raises:
        InputError: repeated names, an unknown parent, a loop, a moving body without mass or
            inertia including the links fixed to it, or too many joints.
    """
    walked, places = _walk(tree, where)
    for body in walked:
        _merge(body, where)
    # numbers of a program may have the base's centre of mass elsewhere, see `Robot.nominal`
    if not tree.exact:
        places = _put_base_at_com(walked, places)
    # a stable sort: actuated joints first, each group branch by branch
    outer = sorted(walked[1:], key=lambda body: _joint(body).passive is not None)
    joints = [_joint(body) for body in outer]
    actuated = [joint for joint in joints if not joint.passive]
    springs = tuple(joint.passive for joint in joints if joint.passive)
    for number, most, what in (
        (len(joints), MOST_JOINTS, "moving joints"),
        (len(springs), MOST_PASSIVE, "passive joints"),
    ):
        if number > most:
            raise InputError(f"{where}: at most {most} {what} can be flown, got {number}")
    if not actuated:
        raise InputError(f"{where}: a robot needs at least one actuated joint")
    bodies = [walked[0], *outer]
    number_of = {id(body): number for number, body in enumerate(bodies)}
    numbers = [number_of[id(body)] for body in walked]
    gears = [joint.drive for joint in actuated]

    def on_body(part: Part) -> Part:
        place = places[part.link]
        number = numbers[place.body]
        return moved(part, place.rotation, place.at, body=number, link=bodies[number].name)

    def by_body(part: Visual | Plate) -> tuple[int, int]:
        place = places[part.link]
        return numbers[place.body], place.rank

    return {
        "name": tree.name,
        "joint_names": tuple(joint.joint_label for joint in actuated),
        "passive_names": tuple(joint.joint_label for joint in joints[len(actuated) :]),
        "body_names": tuple(body.name for body in bodies),
        "mass": np.array([body.mass for body in bodies]),
        "inertia": np.array([body.inertia for body in bodies]),
        "com": np.array([body.com for body in bodies]),
        "parent": np.array([numbers[body.parent] for body in outer]),
        "rotation": np.array([joint.rotation for joint in joints]),
        "offset": np.array([joint.offset for joint in joints]),
        "is_prismatic": np.array([joint.joint == "prismatic" for joint in joints]),
        "limits": tuple(joint.limits for joint in actuated),
        "friction": tuple(joint.friction or SETTINGS_FRICTION for joint in joints),
        "springs": springs,
        "tools": tuple(map(on_body, tree.tools)) or (Tool(body=len(joints), link=bodies[-1].name),),
        "visuals": tuple(map(on_body, sorted(tree.visuals, key=by_body))),
        "order": tuple(number - 1 for number in numbers[1:]),
        "gears": tuple(gears) if any(gears) else (),
        "plates": tuple(map(on_body, sorted(tree.plates, key=by_body))),
    }


def axes_with_z(axis: Array) -> Array:
    """Return a rotation with the unit vector ``axis`` as third column; exact for z, -x, ..."""
    # the axis of the frame that is farthest from it, so that nothing small is divided by
    helper = np.zeros(3)
    helper[np.argmin(np.abs(axis))] = 1.0
    x = helper - product(helper, axis) * axis
    x /= norm(x)
    return np.column_stack((x, np.cross(axis, x), axis))


def parallel_axes(mass: float, arm: Array) -> Array:
    """Return the inertia, kg m2, of a point mass (kg) at ``arm`` (3,), m (parallel axes)."""
    parallel_axes: Array = mass * (product(arm, arm) * np.eye(3) - np.outer(arm, arm))
    return parallel_axes


def _joint(body: MovedBody) -> Body:
    assert body.joint
    return body.joint


def _walk(tree: RobotTree, where: str) -> tuple[list[MovedBody], dict[str, Place]]:
    """Return the bodies of the flattened tree, not yet merged, and the places of all links."""
    bodies, places = [MovedBody(tree.base.name, 0, None)], {}

    def put(part: Base | Body, place: Place) -> None:
        places[part.name] = place
        inertia = rotate_tensor(place.rotation, part.inertia)
        bodies[place.body].members.append((part.mass, place.at(part.com), inertia))

    put(tree.base, Place(0, 0, np.eye(3), np.zeros(3)))
    for rank, link in enumerate(_outwards(tree, where), 1):
        on = places[link.parent]
        if not link.moves:
            rotation = product(on.rotation, link.rotation)
            place = Place(on.body, rank, rotation, on.position + product(rotation, link.offset))
        else:
            axes = axes_with_z(link.axis)
            rotation = product(product(on.rotation, link.rotation), axes)
            offset = product(rotation.T, on.position) + product(axes.T, link.offset)
            joint = replace(link, rotation=rotation, offset=offset, axis=np.eye(3)[2])
            place = Place(len(bodies), rank, axes.T, np.zeros(3))
            bodies.append(MovedBody(link.name, on.body, joint))
        put(link, place)
    return bodies, places


def _outwards(tree: RobotTree, where: str) -> Iterator[Body]:
    """Yield the links branch by branch from the base, in the order of ``tree.links``."""
    names = [tree.base.name, *(link.name for link in tree.links)]
    joints = [link.joint_label for link in tree.links]
    for kind, listed in (("body", names), ("joint", joints)):
        if (name := first_repeated(listed)) is not None:
            raise InputError(f"{where}: {kind} names must differ, {short(name)} occurs twice")
    moving = {link.joint_label: link.name for link in tree.links if link.moves}
    for joint, body in moving.items():
        if meaning := other_meaning(joint, moving):
            raise InputError(f"{where}: joint {short(joint)} needs another name: it is {meaning}")
        if body == "*" or body.isdecimal():
            raise InputError(
                f"{where}: link {short(body)} needs another name: in campaigns it is all links, or "
                "one by its number"
            )
    children: dict[str, list[Body]] = {name: [] for name in names}
    # children are taken from the end of their list: reversed, so that the first comes first
    for link in reversed(tree.links):
        if link.parent not in children:
            raise InputError(
                f"{where}: parent {short(link.parent)} of {short(link.name)} is not a body: "
                f"{choices(link.parent, names)}"
            )
        children[link.parent].append(link)
    waiting, seen = children[tree.base.name].copy(), 0
    while waiting:
        link = waiting.pop()
        waiting += children[link.name]
        seen += 1
        yield link
    if seen < len(tree.links):
        raise InputError(f"{where}: some bodies form a loop that is not connected to the base")


def _merge(body: MovedBody, where: str) -> None:
    body.mass = sum(mass for mass, _, _ in body.members)
    if not body.mass > 0.0:
        raise InputError(f"{where}: moving body {body.name!r} has no mass ({body.mass:g} kg)")
    # a single member keeps its numbers to the bit: no sum, no division
    heavy = [member for member in body.members if member[0] > 0.0]
    _, body.com, body.inertia = heavy[0]
    if len(heavy) > 1:
        body.com = np.sum([mass * com for mass, com, _ in heavy], axis=0) / body.mass
        about = [tensor + parallel_axes(mass, com - body.com) for mass, com, tensor in heavy]
        body.inertia = np.sum(about, axis=0)
    if not (least := np.linalg.eigvalsh(body.inertia)[0]) > 0.0:
        raise InputError(
            f"{where}: the inertia of body {body.name!r} must be positive definite, its smallest "
            f"principal moment is {least:g} kg m2"
        )


def _put_base_at_com(bodies: list[MovedBody], places: dict[str, Place]) -> dict[str, Place]:
    """Move the base's frame to its centre of mass, and return the links' places in it."""
    base, shift = bodies[0], -bodies[0].com
    if not shift.any():
        return places
    base.com = shift + base.com
    for body in bodies[1:]:
        if body.parent == 0:
            joint = _joint(body)
            offset = joint.offset + product(joint.rotation.T, shift)
            body.joint = replace(joint, offset=offset)
    return {
        name: place if place.body else replace(place, shift=shift) for name, place in places.items()
    }
