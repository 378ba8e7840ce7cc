"""Conversion of a file's tree to the form of the algorithms.

Bodies on fixed joints are merged into their parents, every joint axis is the z axis of its body's
frame, and the base's frame is at its centre of mass.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from ...elementary.matrices import norm, product, rotate_tensor
from .bodies import Body

Array = NDArray[np.float64]

OTHER_MEANINGS = {
    "*": "the pattern of all joints in campaigns",
    **dict.fromkeys(BASE_AXES, "the name of a base axis"),
    **dict.fromkeys(("base", "joints", "all"), "a group of axes in faults"),
    **dict.fromkeys(("time", "q_w", "q_x", "q_y", "q_z"), "a column of trajectories"),
    **{
        f"base_{kind}_{axis}": "a column of disturbances"
        for kind in ("force", "torque")
        for axis in "xyz"
    },
}
"""What names of joints would mean elsewhere."""


def other_meaning(name: str, joints: Collection[str] = ()) -> str:
    """Return what the name of a joint would mean elsewhere; empty: nothing.

    Args:
        name: of the joint.
        joints: names of all moving joints.
    """
    if name.isdecimal():
        return "the number of a joint in faults and campaigns"
    if re.fullmatch(r"(wheel|thruster|torquer)_\d+", name):
        return "the name of an actuator of the base"
    if name.endswith("_rate") and (joint := name.removesuffix("_rate")) in joints:
        return f"the column of the rate of {short(joint)} in trajectories"
    return OTHER_MEANINGS.get(name, "")


@dataclass
class Moved:
    """A body of the flattened tree and the joint that moves it; None for the base.

    The z axis of its frame is the joint's axis; `body.com`, tools and visuals are in that frame.
    """

    body: Body
    parent: int
    """Number of the parent `Moved`; the base is 0."""


def flatten(
    bodies: Sequence[Body], where: str = "robot", base_is_at_com: bool = True
) -> list[Moved]:
    """Merge fixed bodies, rotate every joint axis to z, put the base's frame at its CoM.

    Args:
        bodies: in any order.
        where: name of the file, for errors.
        base_is_at_com: False: the base's frame stays where it is in ``bodies``.

    Returns:
        The base, then the bodies with a moving joint, branch by branch in the order of ``bodies``,
        parents before children.

    Raises:
        InputError: repeated names, an unknown parent, not exactly one base, or a moving body
            without mass or inertia, including the bodies fixed to it.
    """
    by_name = _check_names(bodies, where)
    flat: list[Moved] = []
    parts: list[list[Body]] = []
    place: dict[str, tuple[int, Array, Array]] = {}
    """The carrier of each body, and the body's frame in that of the carrier."""
    for body in _outwards(bodies, by_name, where):
        joint = body.joint
        if joint is None:
            place[body.name] = (0, np.eye(3), np.zeros(3))
        else:
            carrier, turned, at = place[body.parent]
            if joint.kind == "fixed":
                rotation = product(turned, joint.rotation)
                place[body.name] = (carrier, rotation, at + product(rotation, joint.offset))
            else:
                axes = axes_with_z(joint.axis)
                rotation = product(product(turned, joint.rotation), axes)
                offset = product(rotation.T, at) + product(axes.T, joint.offset)
                joint = replace(joint, rotation=rotation, offset=offset, axis=np.eye(3)[2])
                place[body.name] = (len(flat), axes.T, np.zeros(3))
        number, rotation, at = place[body.name]
        if number == len(flat):
            flat.append(Moved(replace(body, joint=joint), 0 if joint is None else carrier))
            parts.append([])
        parts[number].append(_moved_to(body, rotation, at))
    for moved, members in zip(flat, parts, strict=True):
        moved.body = _merged(moved.body, members, where)
    if base_is_at_com:
        _put_base_at_com(flat)
    return flat


def axes_with_z(axis: Array) -> Array:
    """Return a rotation with the unit vector ``axis`` as third column; exact for z, -x, ..."""
    helper = np.zeros(3)
    helper[np.argmin(np.abs(axis))] = 1.0
    x = helper - product(helper, axis) * axis
    x /= norm(x)
    return np.column_stack((x, np.cross(axis, x), axis))


def parallel_axes(mass: float, arm: Array) -> Array:
    """Return the inertia, kg m2, of a point mass (kg) at ``arm`` (3,), m (parallel axes)."""
    parallel_axes: Array = mass * (product(arm, arm) * np.eye(3) - np.outer(arm, arm))
    return parallel_axes


def first_repeated(names: Iterable[str]) -> str | None:
    """Return the first repeated name; None if all differ."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


def _check_names(bodies: Sequence[Body], where: str) -> dict[str, Body]:
    by_name = {body.name: body for body in bodies}
    names = [body.name for body in bodies]
    joints = [body.joint.name for body in bodies if body.joint]
    for kind, listed in (("body", names), ("joint", joints)):
        if (name := first_repeated(listed)) is not None:
            raise InputError(f"{where}: {kind} names must differ, {short(name)} occurs twice")
    bases = [body.name for body in bodies if body.joint is None]
    if len(bases) != 1:
        raise InputError(f"{where}: a robot has one base, got {len(bases)}: {bases}")
    moving = {b.joint.name: b.name for b in bodies if b.joint and b.joint.kind != "fixed"}
    for joint, link in moving.items():
        if meaning := other_meaning(joint, moving):
            raise InputError(f"{where}: joint {short(joint)} needs another name: it is {meaning}")
        if link == "*" or link.isdecimal():
            raise InputError(
                f"{where}: link {short(link)} needs another name: in campaigns it is all links, or "
                "one by its number"
            )
    for body in bodies:
        if body.joint and body.parent not in by_name:
            raise InputError(
                f"{where}: parent {short(body.parent)} of {short(body.name)} is not a body: "
                f"{choices(body.parent, names)}"
            )
    return by_name


def _outwards(bodies: Sequence[Body], by_name: dict[str, Body], where: str) -> Iterator[Body]:
    """Yield the bodies branch by branch from the base, in the order of ``bodies``."""
    children: dict[str, list[Body]] = {name: [] for name in by_name}
    for body in reversed(bodies):
        if body.joint:
            children[body.parent].append(body)
    waiting, seen = [body for body in bodies if body.joint is None], 0
    while waiting:
        body = waiting.pop()
        waiting += children[body.name]
        seen += 1
        yield body
    if seen < len(bodies):
        raise InputError(f"{where}: some bodies form a loop that is not connected to the base")


def _moved_to(body: Body, rotation: Array, position: Array) -> Body:
    """Return the body in another frame, given its pose in that frame."""

    def at(vector: Array) -> Array:
        return position + product(rotation, vector)

    return replace(
        body,
        inertia=rotate_tensor(rotation, body.inertia),
        com=at(body.com),
        tools=tuple(
            replace(tool, rotation=product(rotation, tool.rotation), position=at(tool.position))
            for tool in body.tools
        ),
        visuals=tuple(
            replace(seen, rotation=product(rotation, seen.rotation), position=at(seen.position))
            for seen in body.visuals
        ),
        plates=tuple(
            replace(plate, normal=product(rotation, plate.normal), centre=at(plate.centre))
            for plate in body.plates
        ),
    )


def _merged(first: Body, members: list[Body], where: str) -> Body:
    """Return the rigid union of all ``members``, which are in its axes."""
    mass = sum(body.mass for body in members)
    if not mass > 0.0:
        raise InputError(f"{where}: moving body {first.name!r} has no mass ({mass:g} kg)")
    heavy = [body for body in members if body.mass > 0.0]
    com, inertia = heavy[0].com, heavy[0].inertia
    if len(heavy) > 1:
        com = np.sum([body.mass * body.com for body in heavy], axis=0) / mass
        inertia = np.sum([_about(body, com) for body in heavy], axis=0)
    if not np.linalg.eigvalsh(inertia)[0] > 0.0:
        raise InputError(
            f"{where}: the inertia of body {first.name!r} must be positive definite, its smallest "
            f"principal moment is {np.linalg.eigvalsh(inertia)[0]:g} kg m2"
        )
    return replace(
        first,
        mass=mass,
        com=com,
        inertia=inertia,
        tools=tuple(tool for body in members for tool in body.tools),
        visuals=tuple(visual for body in members for visual in body.visuals),
        plates=tuple(plate for body in members for plate in body.plates),
    )


def _about(body: Body, point: Array) -> Array:
    """Return the body's inertia about ``point``, kg m2 (parallel axes)."""
    return body.inertia + parallel_axes(body.mass, body.com - point)


def _put_base_at_com(members: list[Moved]) -> None:
    shift = -members[0].body.com
    if not shift.any():
        return
    members[0].body = _moved_to(members[0].body, np.eye(3), shift)
    for moved in members[1:]:
        joint = moved.body.joint
        if moved.parent == 0 and joint:
            offset = joint.offset + product(joint.rotation.T, shift)
            moved.body = replace(moved.body, joint=replace(joint, offset=offset))
