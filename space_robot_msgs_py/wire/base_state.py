"""/base/state: pose and velocity of the base, and the torque applied to it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .. import topics
from ..errors import MessageError
from ..samples import Timebase
from .message import MessageDescription, Run, SampleColumn, name_order

XYZ = (0, 1, 2)
WXYZ = (3, 0, 1, 2)
"""Indices of a sample's quaternion (w, x, y, z) in ROS's order (x, y, z, w)."""


class BaseState(MessageDescription):
    """A sensor_msgs/MultiDOFJointState of one body; forces are zero."""

    topic = topics.BASE_STATE
    columns = (
        SampleColumn("base_position", 0, 3),
        SampleColumn("quaternion", 0, 4),
        SampleColumn("base_velocity", 0, 3),
        SampleColumn("omega_base", 0, 3),
        SampleColumn("applied_torque", 0, 3),
    )

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages; ``names`` is not used."""
        super().__init__([topics.BASE_JOINT], timebase)

    def content(self, rows: int = 1) -> Mapping[str, Any]:
        """Return the fields: the base in the inertial frame."""
        return {
            "header": {"frame_id": topics.INERTIAL_FRAME},
            "joint_names": self.names,
            "transforms": [{}],
            "twist": [{}],
            "wrench": [{}],
        }

    def runs(self, message: Any) -> Iterable[Run]:
        """Yield pose and velocity in the inertial frame, angular rate and torque in the base's."""
        name_order(message.joint_names, self.names, self.topic.full_name)
        if not (len(message.transforms) == len(message.twist) == len(message.wrench) == 1):
            raise MessageError(f"{self.topic.full_name}: one transform, twist, wrench expected")
        return (
            Run("transforms[0].translation", XYZ),
            Run("transforms[0].rotation", WXYZ),
            Run("twist[0].linear", XYZ),
            Run("twist[0].angular", XYZ),
            Run("wrench[0].torque", XYZ),
        )
