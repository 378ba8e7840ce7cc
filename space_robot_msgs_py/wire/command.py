"""/command: what is asked of every axis and actuator, as a sensor_msgs/JointState's efforts."""

from __future__ import annotations

from collections.abc import Sequence

from .. import topics
from ..samples import RobotNames, Timebase
from .joint_states import JointStates
from .message import SampleColumn


class Commands(JointStates):
    """Efforts by name: of the base's axes (its frame), of the joints, of the base's actuators."""

    topic = topics.COMMAND
    fields = ("effort",)
    frame_id = topics.BASE_FRAME

    def __init__(self, names: Sequence[str], timebase: Timebase, actuators: int = 0) -> None:
        """``actuators``: so many of the names, the last ones, are of the base's actuators."""
        super().__init__(names, timebase)
        self.columns = (SampleColumn("commanded_torque", 0, len(self.names) - actuators),)
        if actuators:
            self.columns += (SampleColumn("actuator_commands", 0, actuators),)

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> Commands:
        """The base's axes come before the joints, its actuators after them."""
        return cls(names.commanded, timebase, len(names.actuators))
