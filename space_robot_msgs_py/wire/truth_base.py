"""/truth/base: the true motion of the base."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .. import topics
from ..errors import MessageError
from ..samples import Timebase
from .base_state import WXYZ, XYZ
from .message import Run, SampleColumn
from .trajectory import Trajectory


class TruthBase(Trajectory):
    """A trajectory_msgs/MultiDOFJointTrajectory of one body, without accelerations."""

    topic = topics.TRUTH_BASE
    columns = (
        SampleColumn("base_position", 0, 3),
        SampleColumn("quaternion", 0, 4),
        SampleColumn("base_velocity", 0, 3),
        SampleColumn("omega_base", 0, 3),
    )
    frame_id = topics.INERTIAL_FRAME

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages; ``names`` is not used."""
        super().__init__([topics.BASE_JOINT], timebase)

    def point(self) -> Mapping[str, Any]:
        """Return the fields of a point with one body."""
        return {"transforms": [{}], "velocities": [{}]}

    def point_runs(self, point: Any, order: Sequence[int]) -> Iterable[Run]:
        """Yield pose, velocity in the inertial frame, angular velocity in the base's frame."""
        if not len(point.transforms) == len(point.velocities) == 1:
            raise MessageError(f"{self.topic.full_name}: a point lacks pose or velocity", "size")
        return (
            Run("transforms[0].translation", XYZ),
            Run("transforms[0].rotation", WXYZ),
            Run("velocities[0].linear", XYZ),
            Run("velocities[0].angular", XYZ),
        )
