"""/reference/joints: the desired motion of the joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .. import topics
from ..errors import MessageError
from ..samples import Timebase
from .message import Run, SampleColumn
from .trajectory import Trajectory

FIELDS = ("positions", "velocities", "accelerations")


class ReferenceJoints(Trajectory):
    """A trajectory_msgs/JointTrajectory without efforts."""

    topic = topics.REFERENCE_JOINTS

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        super().__init__(names, timebase)
        self.columns = (SampleColumn("reference_joints", 0, len(FIELDS) * len(self.names)),)

    def point(self) -> Mapping[str, Any]:
        """Return the fields of a point with one number per joint."""
        return dict.fromkeys(FIELDS, [0.0] * len(self.names))

    def point_runs(self, point: Any, order: Sequence[int]) -> Iterable[Run]:
        """Yield positions, velocities and accelerations, each in the order of our names."""
        for field in FIELDS:
            if len(getattr(point, field)) != len(order):
                raise MessageError(
                    f"{self.topic.full_name}: a point lacks {field} of some joint", "size"
                )
            yield Run(field, order)
