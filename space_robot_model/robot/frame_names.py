"""Names of a robot's frames, as tf, URDF and viewers know them: each is there once."""

from __future__ import annotations

from typing import NamedTuple

from space_robot_msgs_py.topics import BASE_FRAME, INERTIAL_FRAME

from .file import BASE
from .robot import Robot


class FrameNames(NamedTuple):
    """Of each body, the base first, and of each tool."""

    bodies: tuple[str, ...]
    tools: tuple[str, ...]


def frame_names(robot: Robot) -> FrameNames:
    """Return the names of bodies and tools, changed only where ROS has another convention.

    The base of a YAML file is ``base_link`` (REP 105); a URDF's keeps its name. A body that is
    called as a joint is, as all of a YAML file are, becomes a link: ``link1`` of ``joint1``,
    ``elbow_link`` of ``elbow``. Bodies and tools share the names of frames, so a tool that is
    called as a body is, such as the frame of a URDF's last link, is ``<name>_tool``. No frame is
    called as the inertial one or a joint, begins with a slash, or has characters that XML cannot
    hold.
    """
    joints = set(urdf_joint_names(robot))
    taken = {INERTIAL_FRAME, *joints}
    base, *links = robot.body_names
    names = {0: distinct(BASE_FRAME if base == BASE else base, "_body", taken)}
    clashes = [printable(link) in joints for link in links]
    for is_changed in (False, True):  # names that stay as they are come first
        for number, link in enumerate(links, 1):
            if clashes[number - 1] is is_changed:
                names[number] = distinct(_link_name(link) if is_changed else link, "_body", taken)
    bodies = tuple(names[number] for number in range(len(names)))
    return FrameNames(bodies, tuple(distinct(tool.name, "_tool", taken) for tool in robot.tools))


def urdf_joint_names(robot: Robot) -> list[str]:
    """Return the names of the joints, changed only where two are equal in XML."""
    taken: set[str] = set()
    return [distinct(joint, "_", taken) for joint in robot.all_joint_names]


def _link_name(name: str) -> str:
    for joint, link in (("joint", "link"), ("Joint", "Link"), ("JOINT", "LINK")):
        if joint in name:
            return name.replace(joint, link)
    return f"{name}_link"


def distinct(name: str, ending: str, taken: set[str]) -> str:
    """Return a name that is not taken, with an ending if need be, and take it."""
    candidate = printable(name)
    number = 1
    while candidate in taken:
        candidate = f"{printable(name)}{ending}{number if number > 1 else ''}"
        number += 1
    taken.add(candidate)
    return candidate


def printable(name: str) -> str:
    """Return a name as one line without a slash or blanks at its ends."""
    shown = "".join(letter if letter.isprintable() else "_" for letter in name)
    return shown.strip().lstrip("/") or "_"
