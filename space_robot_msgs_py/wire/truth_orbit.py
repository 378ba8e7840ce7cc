"""/truth/orbit: where the inertial frame's origin is, and what acts on the robot from outside."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .. import topics
from ..errors import MessageError
from ..samples import SOURCES, Timebase
from .message import Run, SampleColumn
from .trajectory import Trajectory

NAMES = tuple(
    f"{what}_{axis}"
    for what in (
        "position",
        "velocity",
        "magnetic_field",
        *(f"{source}_torque" for source in SOURCES),
    )
    for axis in "xyz"
)


class TruthOrbit(Trajectory):
    """A trajectory_msgs/JointTrajectory whose names are quantities, and positions their values.

    Position (m) and velocity (m/s) of the origin from the Earth's centre, inertial axes; magnetic
    field, T, base axes; torques by source about the robot's centre of mass, N m, inertial axes.
    """

    topic = topics.TRUTH_ORBIT
    frame_id = topics.INERTIAL_FRAME
    columns = (
        SampleColumn("orbit_position", 0, 3),
        SampleColumn("orbit_velocity", 0, 3),
        SampleColumn("magnetic_field", 0, 3),
        SampleColumn("external_torques", 0, 3 * len(SOURCES)),
    )

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages; ``names`` is not used."""
        super().__init__(NAMES, timebase)

    def point(self) -> Mapping[str, Any]:
        """Return the fields of a point."""
        return {"positions": [0.0] * len(NAMES)}

    def point_runs(self, point: Any, order: Sequence[int]) -> Iterable[Run]:
        """Yield the values in the order of our names."""
        if len(point.positions) != len(order):
            raise MessageError(f"{self.topic.full_name}: a point lacks some value", "size")
        yield Run("positions", order)
