"""/thrusters/state: the force of every thruster."""

from __future__ import annotations

from collections.abc import Sequence

from .. import topics
from ..samples import RobotNames, Timebase
from .joint_states import JointStates
from .message import SampleColumn


class ThrustersState(JointStates):
    """A sensor_msgs/JointState; its efforts are the mean forces over the last tick, N."""

    topic = topics.THRUSTERS_STATE
    fields = ("effort",)
    frame_id = topics.BASE_FRAME

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages; ``names`` are those of the thrusters."""
        super().__init__(names, timebase)
        self.columns = (SampleColumn("thrusts", 0, len(self.names)),)

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> ThrustersState:
        """Describe the messages for the thrusters."""
        return cls(names.thrusters, timebase)
