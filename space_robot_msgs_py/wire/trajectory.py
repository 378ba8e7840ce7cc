"""Common base of trajectory messages: points with a spacing of one tick."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..errors import MessageError
from .message import MessageDescription, Run, name_order


class Trajectory(MessageDescription):
    """A trajectory message: one row per point, the first at the message's stamp.

    The times of the points are a constant part of the layout.
    """

    frame_id = ""

    @abstractmethod
    def point(self) -> Mapping[str, Any]:
        """Return the fields of one of our points."""

    @abstractmethod
    def point_runs(self, point: Any, order: Sequence[int]) -> Iterable[Run]:
        """Yield the numbers of a decoded point; ``order``: index of our names in the message.

        Raises:
            MessageError: numbers are missing.
        """

    def content(self, rows: int) -> Mapping[str, Any]:
        """Return names and ``rows`` points."""
        after = [divmod(self.timebase.stamp_ns(i), 1_000_000_000) for i in range(rows)]
        return {
            "header": {"frame_id": self.frame_id},
            "joint_names": self.names,
            "points": [
                {**self.point(), "time_from_start": {"sec": sec, "nanosec": nanosec}}
                for sec, nanosec in after
            ],
        }

    def runs(self, message: Any) -> Iterable[Run]:
        """Yield the numbers point by point."""
        order = name_order(message.joint_names, self.names, self.topic.full_name)
        if not message.points:
            raise MessageError(f"{self.topic.full_name}: a trajectory without points")
        for i, point in enumerate(message.points):
            after = point.time_from_start
            if after.sec * 1_000_000_000 + after.nanosec != self.timebase.stamp_ns(i):
                raise MessageError(
                    f"{self.topic.full_name}: point {i} is not {i} ticks after its message's stamp"
                )
            for path, places in self.point_runs(point, order):
                yield Run(f"points[{i}].{path}", places)
