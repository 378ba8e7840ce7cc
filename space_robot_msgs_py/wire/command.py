"""/command: commands of all axes and actuators, as efforts of a sensor_msgs/JointState."""

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
        """Describe the messages; the last ``actuators`` names are the base's actuators."""
        super().__init__(names, timebase)
        self.columns = (SampleColumn("commanded_torque", 0, len(self.names) - actuators),)
        if actuators:
            self.columns += (SampleColumn("actuator_commands", 0, actuators),)

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> Commands:
        """Describe the messages of a robot: base axes, joints, base actuators."""
        return cls(names.commanded, timebase, len(names.actuators))
