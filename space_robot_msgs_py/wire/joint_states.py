"""/joint_states: position, velocity and effort of every joint, by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .. import topics
from ..errors import MessageError
from ..samples import RobotNames, Timebase
from .message import MessageDescription, Run, SampleColumn, name_order


class JointStates(MessageDescription):
    """A sensor_msgs/JointState; its efforts are the torques and forces applied to the joints.

    Passive joints come after the actuated ones and have no efforts.
    """

    topic = topics.JOINT_STATES
    fields: tuple[str, ...] = ("position", "velocity", "effort")
    frame_id: str = ""

    def __init__(self, names: Sequence[str], timebase: Timebase, passive: int = 0) -> None:
        """Describe the messages; the last ``passive`` names are passive joints."""
        super().__init__(names, timebase)
        self._passive = passive
        n = len(self.names) - passive
        self.columns = (
            SampleColumn("joint_positions", 0, n),
            SampleColumn("passive_positions", 0, passive),
            SampleColumn("joint_velocities", 0, n),
            SampleColumn("passive_velocities", 0, passive),
            SampleColumn("applied_torque", 3, n),
        )

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> JointStates:
        """Describe the messages for all joints."""
        return cls(names.all_joints, timebase, len(names.passive))

    def content(self, rows: int = 1) -> Mapping[str, Any]:
        """Return names, and the fields with zeros."""
        numbers = [0.0] * len(self.names)
        return {
            "header": {"frame_id": self.frame_id},
            "name": self.names,
            **dict.fromkeys(self.fields, numbers),
        }

    def runs(self, message: Any) -> Iterable[Run]:
        """Yield the fields in the order of our names, for any order in the message."""
        order = name_order(message.name, self.names, self.topic.full_name)
        for field in self.fields:
            count = len(getattr(message, field))
            if count != len(order):
                raise MessageError(
                    f"{self.topic.full_name}: {count} values of {field} for {len(order)} names",
                    "size",
                )
            yield Run(field, order[: count - self._passive] if field == "effort" else order)
