"""/robot_description: the robot as the text of a URDF, for whoever draws or plans with it."""

from __future__ import annotations

from .. import topics
from .cdr import MessageLayout


def robot_description(text: str) -> bytes:
    """Return the std_msgs/String of a URDF, with ends of lines behind it up to a whole word.

    The middleware would fill that up with zeros: so it is sent as it is written here.
    """
    missing = -(len(text.encode()) + 1) % 4
    return MessageLayout(topics.ROBOT_DESCRIPTION.type, {"data": text + missing * "\n"}).data
