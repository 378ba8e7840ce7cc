"""Names of the axes and actuators that a fault affects."""

from __future__ import annotations

from enum import Enum

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames
from space_robot_msgs_py.topics import BASE_AXES


class About(Enum):
    """Kind of axes or base actuators that a kind of fault can affect."""

    AXIS = "AXIS a name, a joint counted from 1, base, joints or all"
    JOINT = "JOINT a name, counted from 1, or joints"
    BASE_AXIS = "BASE_AXIS a name, or base"
    WHEEL = "WHEEL a name, counted from 1, or wheels"
    THRUSTER = "THRUSTER a name, counted from 1, or thrusters"


def axes_of(name: str, about: About, names: RobotNames) -> tuple[int, ...]:
    """Return the indices of a fault's ``name`` among all axes, wheels or thrusters.

    A thing of that name comes first, then a group of them, then a number.

    Args:
        name: as written in the fault.
        about: the things that are allowed.
        names: of what there is.

    Raises:
        InputError: the name does not exist; the message lists the names.
    """
    base, every = len(BASE_AXES), range(len(names.axes))
    of_base, of_joints = {"base": tuple(every[:base])}, {"joints": tuple(every[base:])}
    those = names.axes
    match about:
        case About.AXIS:
            meant, counted = every, every[base:]
            groups = {**of_base, **of_joints, "all": tuple(every)}
        case About.JOINT:
            meant, counted, groups = every[base:], every[base:], of_joints
        case About.BASE_AXIS:
            meant, counted, groups = every[:base], every[:0], of_base
        case _:
            group = f"{about.name.lower()}s"
            those = names.wheels if about is About.WHEEL else names.thrusters
            meant = counted = range(len(those))
            groups = {group: tuple(meant)} if those else {}
    numbers = {str(1 + place - counted.start): (place,) for place in counted}
    known = {those[place]: (place,) for place in meant}
    axes = {**numbers, **groups, **known}.get(name)
    if axes is None:
        also = [*([f"1 to {len(numbers)}"] if numbers else []), *groups]
        advice = choices(name, known, f", {', '.join(also)}") if known else "there is none"
        raise InputError(f"no {about.name.lower().replace('_', ' ')} {short(name)}: {advice}")
    return axes
