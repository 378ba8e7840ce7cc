"""/reference/base: the desired attitude motion of the base."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .. import topics
from ..errors import MessageError
from ..samples import Timebase
from .base_state import WXYZ, XYZ
from .message import Run, SampleColumn
from .trajectory import Trajectory


class ReferenceBase(Trajectory):
    """A trajectory_msgs/MultiDOFJointTrajectory of one body; its linear parts are zero."""

    topic = topics.REFERENCE_BASE
    columns = (SampleColumn("reference_base", 0, 10),)
    frame_id = topics.INERTIAL_FRAME

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages; ``names`` is not used."""
        super().__init__([topics.BASE_JOINT], timebase)

    def point(self) -> Mapping[str, Any]:
        """Return the fields of a point with one body."""
        return {"transforms": [{}], "velocities": [{}], "accelerations": [{}]}

    def point_runs(self, point: Any, order: Sequence[int]) -> Iterable[Run]:
        """Yield quaternion w, x, y, z, angular velocity and acceleration in the base's frame."""
        if not len(point.transforms) == len(point.velocities) == len(point.accelerations) == 1:
            raise MessageError(
                f"{self.topic.full_name}: a point lacks pose, velocity or acceleration", "size"
            )
        return (
            Run("transforms[0].rotation", WXYZ),
            Run("velocities[0].angular", XYZ),
            Run("accelerations[0].angular", XYZ),
        )
