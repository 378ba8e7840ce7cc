"""Names of a robot's frames, as tf, URDF and viewers know them: each is there once."""

from __future__ import annotations

from typing import NamedTuple

from space_robot_msgs_py.topics import INERTIAL_FRAME

from .robot import Robot


class FrameNames(NamedTuple):
    """Of each body, the base first, and of each tool."""

    bodies: tuple[str, ...]
    tools: tuple[str, ...]


def frame_names(robot: Robot) -> FrameNames:
    """Return the names of bodies and tools, changed only where they would not do.

    Bodies and tools share the names of frames, so a tool that is called as a body is, such as the
    frame of a URDF's last link, is ``<name>_tool``. No frame is called as the inertial one, begins
    with a slash, or has characters that XML cannot hold.
    """
    taken = {INERTIAL_FRAME}
    bodies = tuple(distinct(name, "_body", taken) for name in robot.body_names)
    return FrameNames(bodies, tuple(distinct(tool.name, "_tool", taken) for tool in robot.tools))


def distinct(name: str, ending: str, taken: set[str]) -> str:
    """Return a name that is not taken, with an ending if need be, and take it."""
    found = printable(name)
    number = 1
    while found in taken:
        found = f"{printable(name)}{ending}{number if number > 1 else ''}"
        number += 1
    taken.add(found)
    return found


def printable(name: str) -> str:
    """Return a name as one line without a slash or blanks at its ends."""
    shown = "".join(letter if letter.isprintable() else "_" for letter in name)
    return shown.strip().lstrip("/") or "_"
