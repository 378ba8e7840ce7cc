"""/truth/joints: true motion of the controlled axes, and the torques actually applied."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .. import topics
from ..errors import MessageError
from ..samples import RobotNames, Timebase
from .message import Run, SampleColumn
from .trajectory import Trajectory

FIELDS = ("positions", "velocities", "effort")


class TruthJoints(Trajectory):
    """A trajectory_msgs/JointTrajectory of base x, y, z and the joints, as in /command.

    The base's positions are the vector part of its quaternion, its velocities are in base axes.
    Passive joints come last and have no efforts.
    """

    topic = topics.TRUTH_JOINTS

    def __init__(self, names: Sequence[str], timebase: Timebase, passive: int = 0) -> None:
        """Describe the messages; the last ``passive`` names of joints are passive."""
        n = len(names) - passive
        super().__init__((*topics.BASE_AXES, *names), timebase)
        self._passive = passive
        self.columns = (
            SampleColumn("quaternion", 1, 3),
            SampleColumn("joint_positions", 0, n),
            SampleColumn("passive_positions", 0, passive),
            SampleColumn("omega_base", 0, 3),
            SampleColumn("joint_velocities", 0, n),
            SampleColumn("passive_velocities", 0, passive),
            SampleColumn("applied_torque", 0, n + 3),
        )

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> TruthJoints:
        """Describe the messages for all joints."""
        return cls(names.all_joints, timebase, len(names.passive))

    def point(self) -> Mapping[str, Any]:
        """Return the fields of a point with one number per axis."""
        return dict.fromkeys(FIELDS, [0.0] * len(self.names))

    def point_runs(self, point: Any, order: Sequence[int]) -> Iterable[Run]:
        """Yield positions, velocities and efforts, each in the order of our names."""
        for field in FIELDS:
            if len(getattr(point, field)) != len(order):
                raise MessageError(
                    f"{self.topic.full_name}: a point lacks {field} of some axis", "size"
                )
            yield Run(field, order[: len(order) - self._passive] if field == "effort" else order)
