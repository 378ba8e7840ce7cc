"""The desired motion as /reference/joints and /reference/base, and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import ReferenceChunk, Timebase
from .cdr import CdrBuilder, FixedMessage, Slot
from .decoded import name_order, stamp_of, xyz
from .definitions import decode

Array = NDArray[np.float64]


class _Trajectory:
    """A trajectory message of a fixed number of points: rows of values and times from start."""

    def __init__(
        self, builder: CdrBuilder, stamp: Slot, slots: list[list[Slot]], timebase: Timebase
    ) -> None:
        self._stamp = stamp
        self.message: FixedMessage = builder.build()
        *values, after = zip(*slots, strict=True)
        self.columns = [self.message.float64_rows(column) for column in values]
        self._after = self.message.stamp_rows(after)
        self._after[:] = self._expected = np.array(
            [divmod(timebase.stamp_ns(i), 1_000_000_000) for i in range(len(slots))], dtype=np.int32
        )

    def encode(self, stamp_ns: int) -> bytes:
        self.message.set_stamp(self._stamp, stamp_ns)
        return self.message.to_bytes()

    def load(self, data: bytes) -> int | None:
        """Stamp in ns if ``data`` is laid out like this, its points one tick apart."""
        if not self.message.load(data) or not np.array_equal(self._after, self._expected):
            self._after[:] = self._expected
            return None
        return self.message.stamp_ns(self._stamp)


def _joints(names: Sequence[str], timebase: Timebase, length: int) -> _Trajectory:
    """trajectory_msgs/JointTrajectory."""
    builder = CdrBuilder()
    stamp = builder.header_slot("")
    builder.strings(names)
    builder.uint32(length)
    points = []
    for _ in range(length):
        point = [builder.float64_sequence_slot(len(names)) for _ in range(3)]
        builder.float64_sequence_slot(0)  # effort
        points.append([*point, builder.stamp_slot()])
    return _Trajectory(builder, stamp, points, timebase)


def _base(timebase: Timebase, length: int) -> _Trajectory:
    """trajectory_msgs/MultiDOFJointTrajectory."""
    builder = CdrBuilder()
    stamp = builder.header_slot(topics.INERTIAL_FRAME)
    builder.strings([topics.BASE_FRAME])
    builder.uint32(length)
    points = []
    for _ in range(length):
        point = []
        for width in (7, 6, 6):  # Transform[1], Twist[1] velocities, Twist[1] accelerations
            builder.uint32(1)
            point.append(builder.float64_slot(width))
        points.append([*point, builder.stamp_slot()])
    return _Trajectory(builder, stamp, points, timebase)


class ReferenceCodec:
    """`ReferenceChunk` to and from its two messages.

    Lengths may differ from message to message; those of one length are fast.
    """

    def __init__(self, joint_names: Sequence[str], timebase: Timebase) -> None:
        self._names, self._timebase = tuple(joint_names), timebase
        self._lay_out_joints(1)
        self._lay_out_base(1)

    def _lay_out_joints(self, length: int) -> None:
        self._length = length
        self._joints = _joints(self._names, self._timebase, length)

    def _lay_out_base(self, length: int) -> None:
        self._base_length = length
        self._base = _base(self._timebase, length)

    def encode(self, chunk: ReferenceChunk) -> tuple[bytes, bytes]:
        """The bytes of /reference/joints and /reference/base."""
        length = len(chunk.joints)
        if length != self._length:
            self._lay_out_joints(length)
        if length != self._base_length:
            self._lay_out_base(length)
        for i, column in enumerate(self._joints.columns):
            column[:] = chunk.joints[:, i]
        pose, velocity, acceleration = self._base.columns
        pose[:, 3:6], pose[:, 6] = chunk.base[:, 1:4], chunk.base[:, 0]
        velocity[:, 3:], acceleration[:, 3:] = chunk.base[:, 4:7], chunk.base[:, 7:]
        stamp_ns = self._timebase.stamp_ns(chunk.start)
        return self._joints.encode(stamp_ns), self._base.encode(stamp_ns)

    def decode_joints(self, data: bytes) -> tuple[int, Array]:
        """First tick and (k, 3, n) rows of a /reference/joints.

        Raises:
            MessageError: other joints than expected, or points not one tick apart.
        """
        stamp_ns = self._joints.load(data)
        if stamp_ns is not None:
            return self._timebase.tick(stamp_ns), np.stack(self._joints.columns, axis=1)
        topic = topics.REFERENCE_JOINTS
        message = decode(data, topic.type)
        order = name_order(message.joint_names, self._names, topic.name)
        self._check_spacing(message.points, topic.name)
        rows = [(p.positions, p.velocities, p.accelerations) for p in message.points]
        if any(len(column) != len(order) for row in rows for column in row):
            raise MessageError(
                f"{topic.name}: a point lacks positions, velocities or accelerations of some joint"
            )
        values = np.array(rows, dtype=np.float64)
        self._lay_out_joints(len(rows))
        return self._timebase.tick(stamp_of(message)), values[:, :, order]

    def decode_base(self, data: bytes) -> tuple[int, Array]:
        """First tick and (k, 10) rows of a /reference/base.

        Raises:
            MessageError: points not one tick apart.
        """
        stamp_ns = self._base.load(data)
        if stamp_ns is not None:
            pose, velocity, acceleration = self._base.columns
            rows = np.hstack([pose[:, 6:], pose[:, 3:6], velocity[:, 3:], acceleration[:, 3:]])
            return self._timebase.tick(stamp_ns), rows
        message = decode(data, topics.REFERENCE_BASE.type)
        name_order(message.joint_names, [topics.BASE_FRAME], topics.REFERENCE_BASE.name)
        self._check_spacing(message.points, topics.REFERENCE_BASE.name)
        values = np.empty((len(message.points), 10))
        for row, point in zip(values, message.points, strict=True):
            if not (point.transforms and point.velocities and point.accelerations):
                raise MessageError(
                    f"{topics.REFERENCE_BASE.name}: a point lacks pose, velocity or acceleration"
                )
            rotation = point.transforms[0].rotation
            row[0], row[1:4] = rotation.w, xyz(rotation)
            row[4:7] = xyz(point.velocities[0].angular)
            row[7:10] = xyz(point.accelerations[0].angular)
        self._lay_out_base(len(values))
        return self._timebase.tick(stamp_of(message)), values

    def _check_spacing(self, points: Sequence[Any], topic: str) -> None:
        if not points:
            raise MessageError(f"{topic}: a trajectory without points")
        for i, point in enumerate(points):
            after = point.time_from_start
            if after.sec * 1_000_000_000 + after.nanosec != self._timebase.stamp_ns(i):
                raise MessageError(f"{topic}: point {i} is not {i} ticks after its message's stamp")
