"""/command: the torque of every axis, as the efforts of a sensor_msgs/JointState."""

from __future__ import annotations

from collections.abc import Sequence

from .. import topics
from ..samples import Timebase
from .joint_states import JointStates
from .message import Column


class Commands(JointStates):
    """Efforts of the axes by name: the base's (in its frame) and the joints'."""

    topic = topics.COMMAND
    fields = ("effort",)
    frame_id = topics.BASE_FRAME

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        super().__init__(names, timebase)
        self.columns = (Column("commanded_torque", 0, len(self.names)),)

    @classmethod
    def of_robot(cls, joint_names: Sequence[str], timebase: Timebase) -> Commands:
        """The base's axes come before the joints."""
        return cls((*topics.BASE_AXES, *joint_names), timebase)
