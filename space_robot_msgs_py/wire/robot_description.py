"""/robot_description: the robot as the text of a URDF, for whoever draws or plans with it."""

from __future__ import annotations

from .. import topics
from .cdr import MessageLayout


def robot_description(text: str) -> bytes:
    """Return the std_msgs/String of a URDF, filled up to whole words as the middleware does it."""
    data = MessageLayout(topics.ROBOT_DESCRIPTION.type, {"data": text}).data
    return data + bytes(-len(data) % 4)
