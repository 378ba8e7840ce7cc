"""Unique names of a robot's frames, for tf, URDF and viewers."""

from __future__ import annotations

from typing import NamedTuple

from space_robot_msgs_py.topics import BASE_FRAME, INERTIAL_FRAME

from .link_file import BASE
from .robot import Robot


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
