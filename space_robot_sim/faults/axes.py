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
    BASE_AXIS = "BASE_AXIS a name, or base"


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
    of_base, of_joints = {"base": tuple(every[:base])}, {"joints": tuple(every[base:])}
    numbers = {str(1 + axis - base): (axis,) for axis in every[base:]}
    meant, groups = {
        About.AXIS: (every, {**of_base, **of_joints, "all": tuple(every)}),
        About.JOINT: (every[base:], of_joints),
        About.BASE_AXIS: (every[:base], of_base),
    }[about]
    numbers = {} if about is About.BASE_AXIS else numbers
    names = {axis_names[axis]: (axis,) for axis in meant}
    found = {**numbers, **groups, **names}.get(name)
    if found is None:
        counted = [f"1 to {len(numbers)}"] if numbers else []
        what, allowed = about.name.lower().replace("_", " "), ", ".join((*names, *counted, *groups))
        raise InputError(f"no {what} {short(name)}: choose one of {allowed}")
    return found
