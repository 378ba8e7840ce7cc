"""The common part of both halves of the reference: points one tick apart."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..errors import MessageError
from .message import MessageDescription, Run, name_order


class Trajectory(MessageDescription):
    """A trajectory message: a row a point, the first at the message's stamp.

    The times of the points are no numbers but part of the layout: all messages have the same.
    """

    frame_id = ""

    @abstractmethod
    def point(self) -> Mapping[str, Any]:
        """The fields of one of our points."""

    @abstractmethod
    def point_runs(self, point: Any, order: Sequence[int]) -> Iterable[Run]:
        """The numbers of a decoded point; ``order``: where our names stand among the message's.

        Raises:
            MessageError: it lacks some.
        """

    def content(self, rows: int) -> Mapping[str, Any]:
        """Names, and so many points."""
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
        """Point by point."""
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
