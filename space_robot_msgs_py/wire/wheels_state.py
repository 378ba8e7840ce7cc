"""/wheels/state: speed of every reaction wheel, and the torque of its motor."""

from __future__ import annotations

from collections.abc import Sequence

from .. import topics
from ..samples import RobotNames, Timebase
from .joint_states import JointStates
from .message import SampleColumn


class WheelsState(JointStates):
    """A sensor_msgs/JointState: speeds relative to the base, rad/s, and motor torques, N m."""

    topic = topics.WHEELS_STATE
    fields = ("velocity", "effort")
    frame_id = topics.BASE_FRAME

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages; ``names`` are those of the wheels."""
        super().__init__(names, timebase)
        count = len(self.names)
        self.columns = (
            SampleColumn("wheel_velocities", 0, count),
            SampleColumn("wheel_torques", 0, count),
        )

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> WheelsState:
        """Describe the messages for the wheels."""
        return cls(names.wheels, timebase)
