"""Names of a robot: which ones joints may have, and those of its frames in tf, URDF and viewers."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING, NamedTuple

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.topics import BASE_AXES, BASE_FRAME, INERTIAL_FRAME

if TYPE_CHECKING:
    from .robot import Robot

BASE = "base"
"""Name of the base in a robot's file."""
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


def first_repeated(names: Iterable[str]) -> str | None:
    """Return the first repeated name; None if all differ."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None


class FrameNames(NamedTuple):
    """Names of the frames of all bodies, the base first, and of all tools."""

    bodies: tuple[str, ...]
    tools: tuple[str, ...]


def frame_names(robot: Robot) -> FrameNames:
    """Return the frame names of bodies and tools, following the conventions of ROS.

    The base of a YAML file is ``base_link`` (REP 105); that of a URDF keeps its name. A body with
    the name of a joint, as in YAML files, becomes a link: ``link1`` for ``joint1``, ``elbow_link``
    for ``elbow``. A tool with the name of a body, such as a URDF's last link, becomes
    ``<name>_tool``. No frame has the name of the inertial frame or of a joint, starts with a slash,
    or contains characters that are invalid in XML.
    """
    joints = set(urdf_joint_names(robot))
    taken = {INERTIAL_FRAME, *joints}
    base, *links = robot.body_names
    names = {0: distinct(BASE_FRAME if base == BASE else base, "_body", taken)}
    clashes = [printable(link) in joints for link in links]
    for is_changed in (False, True):  # unchanged names have priority
        for number, link in enumerate(links, 1):
            if clashes[number - 1] is is_changed:
                names[number] = distinct(_link_name(link) if is_changed else link, "_body", taken)
    bodies = tuple(names[number] for number in range(len(names)))
    return FrameNames(bodies, tuple(distinct(tool.name, "_tool", taken) for tool in robot.tools))


def urdf_joint_names(robot: Robot) -> list[str]:
    """Return the names of the joints, changed only if two are equal in XML."""
    taken: set[str] = set()
    return [distinct(joint, "_", taken) for joint in robot.all_joint_names]


def _link_name(name: str) -> str:
    for joint, link in (("joint", "link"), ("Joint", "Link"), ("JOINT", "LINK")):
        if joint in name:
            return name.replace(joint, link)
    return f"{name}_link"


def distinct(name: str, ending: str, taken: set[str]) -> str:
    """Return an unused name, with a suffix if necessary, and add it to ``taken``."""
    candidate = printable(name)
    number = 1
    while candidate in taken:
        candidate = f"{printable(name)}{ending}{number if number > 1 else ''}"
        number += 1
    taken.add(candidate)
    return candidate


def printable(name: str) -> str:
    """Return a name as one line, without slashes or spaces at its ends."""
    shown = "".join(letter if letter.isprintable() else "_" for letter in name)
    return shown.strip().lstrip("/") or "_"
