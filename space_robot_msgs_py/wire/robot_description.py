"""/robot_description: the robot as URDF text, for viewers and planners."""

from __future__ import annotations

from .. import topics
from .cdr import MessageLayout


def robot_description(text: str) -> bytes:
    """Return the std_msgs/String of a URDF, padded with newlines to a multiple of the word size.

    Otherwise the middleware would append zeros, and received bytes would differ.
    """
    missing = -(len(text.encode()) + 1) % 4
    return MessageLayout(topics.ROBOT_DESCRIPTION.type, {"data": text + missing * "\n"}).data
