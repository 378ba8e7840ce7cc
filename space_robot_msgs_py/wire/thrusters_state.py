"""/thrusters/state: the force of every thruster."""

from __future__ import annotations

from collections.abc import Sequence

from .. import topics
from ..samples import RobotNames, Timebase
from .joint_states import JointStates
from .message import SampleColumn


class ThrustersState(JointStates):
    """A sensor_msgs/JointState whose efforts are forces, N: the means over the last interval."""

    topic = topics.THRUSTERS_STATE
    fields = ("effort",)
    frame_id = topics.BASE_FRAME

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """``names``: of the thrusters."""
        super().__init__(names, timebase)
        self.columns = (SampleColumn("thrusts", 0, len(self.names)),)

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> ThrustersState:
        """The thrusters alone."""
        return cls(names.thrusters, timebase)
