"""/motors/state: motion of the motors of joints with gears, seen through the gears."""

from __future__ import annotations

from collections.abc import Sequence

from .. import topics
from ..samples import RobotNames, Timebase
from .joint_states import JointStates
from .message import SampleColumn


class MotorsState(JointStates):
    """A sensor_msgs/JointState: angle and velocity on the link's side, rad and rad/s, by joint."""

    topic = topics.MOTORS_STATE
    fields = ("position", "velocity")

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages; ``names`` are those of the joints with gears."""
        super().__init__(names, timebase)
        count = len(self.names)
        self.columns = (
            SampleColumn("motor_positions", 0, count),
            SampleColumn("motor_velocities", 0, count),
        )

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> MotorsState:
        """Describe the messages for the motors."""
        return cls(names.geared, timebase)
