"""The axes that a fault is about, by name."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES


class About(Enum):
    """The axes that a kind of fault may be about."""

    AXIS = "AXIS a name, a joint counted from 1, base, joints or all"
    JOINT = "JOINT a name, counted from 1, or joints"


def axes_of(name: str, about: About, axis_names: Sequence[str]) -> tuple[int, ...]:
    """Return the places, among a robot's n+3 axes, of the axes that a fault's ``name`` means.

    An axis of that name comes first, then a group of axes, then a joint's number.

    Args:
        name: as written in the fault.
        about: the axes that are allowed.
        axis_names: base x, y, z, then the joints, as `space_robot_sim.robot.Robot.axis_names`.

    Raises:
        InputError: the robot has no such axis; it says which there are.
    """
    base, every = len(BASE_AXES), range(len(axis_names))
    first = base if about is About.JOINT else 0
    numbers = {str(1 + axis - base): (axis,) for axis in every[base:]}
    groups = {"joints": tuple(every[base:])}
    if about is About.AXIS:
        groups = {"base": tuple(every[:base]), **groups, "all": tuple(every)}
    names = {axis_names[axis]: (axis,) for axis in every[first:]}
    found = {**numbers, **groups, **names}.get(name)
    if found is None:
        allowed = ", ".join((*names, f"1 to {len(numbers)}", *groups))
        raise InputError(f"no {about.name.lower()} {short(name)}: choose one of {allowed}")
    return found
