"""/magnetometer: the magnetic field at the base."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .. import topics
from ..samples import RobotNames, Timebase
from .base_state import XYZ
from .message import MessageDescription, Run, SampleColumn


class Magnetometer(MessageDescription):
    """A sensor_msgs/MagneticField, T, base frame; its covariance is zero: not known."""

    topic = topics.MAGNETOMETER
    columns = (SampleColumn("magnetic_field", 0, 3),)

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages; ``names`` are those of the magnetic torquers that need them."""
        super().__init__(names, timebase)

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> Magnetometer:
        """Describe the messages for the magnetic torquers."""
        return cls(names.torquers, timebase)

    def content(self, rows: int = 1) -> Mapping[str, Any]:
        """Return the fields."""
        return {"header": {"frame_id": topics.BASE_FRAME}}

    def runs(self, message: Any) -> Iterable[Run]:
        """Yield the field."""
        return (Run("magnetic_field", XYZ),)
