"""Samples to messages and back: one codec a topic, on the fixed layouts of `cdr`.

A codec encodes into bytes that any ROS 2 tool reads. It decodes its own layout by copying
bytes, and any other valid message of the type (another frame, other lengths of unused fields,
joints in another order) by way of the general decoder.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import topics
from .cdr import CdrBuilder
from .definitions import decode
from .samples import Command, ReferenceChunk, RobotState, Timebase

Array = NDArray[np.float64]


def _stamp(message: Any) -> int:
    stamp = message.header.stamp
    return int(stamp.sec * 1_000_000_000 + stamp.nanosec)


def _order(given: Sequence[str], expected: Sequence[str], topic: str) -> list[int]:
    if sorted(given) != sorted(expected):
        raise ValueError(f"{topic}: names {list(given)}, expected {list(expected)}")
    return [list(given).index(name) for name in expected]


class JointStateCodec:
    """sensor_msgs/JointState with the given names; ``fields`` says which arrays are filled."""

    def __init__(
        self,
        topic: topics.Topic,
        names: Sequence[str],
        frame_id: str = "",
        fields: Sequence[str] = ("position", "velocity", "effort"),
    ) -> None:
        self._topic, self._names, self._fields = topic, tuple(names), tuple(fields)
        self._lay_out(frame_id)

    def _lay_out(self, frame_id: str) -> None:
        builder = CdrBuilder()
        self._stamp = builder.header_slot(frame_id)
        builder.strings(self._names)
        count = len(self._names)
        slots = [
            builder.float64_sequence_slot(count if field in self._fields else 0)
            for field in ("position", "velocity", "effort")
        ]
        self._message = builder.build()
        self.position, self.velocity, self.effort = (self._message.float64(s) for s in slots)

    def encode(self, stamp_ns: int) -> bytes:
        """The message with what ``position``, ``velocity`` and ``effort`` hold."""
        self._message.set_stamp(self._stamp, stamp_ns)
        return self._message.to_bytes()

    def decode(self, data: bytes) -> int:
        """Fill the arrays from a message; returns its stamp in ns.

        Raises:
            ValueError: other joints than expected, or an array missing.
        """
        if self._message.load(data):
            return self._message.stamp_ns(self._stamp)
        message = decode(data, self._topic.type)
        order = _order(message.name, self._names, self._topic.name)
        if order == sorted(order):
            self._lay_out(message.header.frame_id)  # same order: the next one is read fast
        for field in self._fields:
            values = getattr(message, field)
            if len(values) != len(self._names):
                raise ValueError(
                    f"{self._topic.name}: {len(values)} values of {field} "
                    f"for {len(self._names)} names"
                )
            getattr(self, field)[:] = values[order]
        return _stamp(message)


class StateCodec:
    """`RobotState` as the pair /joint_states and /base/state."""

    def __init__(self, joint_names: Sequence[str], timebase: Timebase) -> None:
        self._timebase = timebase
        self._joints = JointStateCodec(topics.JOINT_STATES, joint_names)
        builder = CdrBuilder()
        self._stamp = builder.header_slot(topics.INERTIAL_FRAME)
        builder.strings([topics.BASE_FRAME])
        slots = []
        for width in (7, 6, 6):  # Transform[1], Twist[1], Wrench[1]
            builder.uint32(1)
            slots.append(builder.float64_slot(width))
        self._base = builder.build()
        self._pose, self._twist, self._wrench = (self._base.float64(slot) for slot in slots)

    def encode(self, state: RobotState) -> tuple[bytes, bytes]:
        """The bytes of /joint_states and /base/state."""
        stamp_ns = self._timebase.stamp_ns(state.tick)
        joints = self._joints
        joints.position[:] = state.joint_positions
        joints.velocity[:] = state.joint_velocities
        joints.effort[:] = state.applied_torque[3:]
        self._pose[:3] = state.base_position
        self._pose[3:6] = state.quaternion[1:]
        self._pose[6] = state.quaternion[0]
        self._twist[:3] = state.base_velocity
        self._twist[3:] = state.omega_base
        self._wrench[3:] = state.applied_torque[:3]
        self._base.set_stamp(self._stamp, stamp_ns)
        return joints.encode(stamp_ns), self._base.to_bytes()

    def decode_joints(self, data: bytes, state: RobotState) -> int:
        """Fill the joints' part of ``state``; returns the tick."""
        tick = self._timebase.tick(self._joints.decode(data))
        state.joint_positions[:] = self._joints.position
        state.joint_velocities[:] = self._joints.velocity
        state.applied_torque[3:] = self._joints.effort
        return tick

    def decode_base(self, data: bytes, state: RobotState) -> int:
        """Fill the base's part of ``state``; returns the tick."""
        if self._base.load(data):
            stamp_ns = self._base.stamp_ns(self._stamp)
        else:
            message = decode(data, topics.BASE_STATE.type)
            if not (len(message.transforms) == len(message.twist) == len(message.wrench) == 1):
                raise ValueError(f"{topics.BASE_STATE.name}: one transform, twist, wrench expected")
            self._pose[:] = transform_values(message.transforms[0])
            self._twist[:] = twist_values(message.twist[0])
            self._wrench[3:] = xyz(message.wrench[0].torque)
            stamp_ns = _stamp(message)
        state.base_position[:] = self._pose[:3]
        state.quaternion[1:] = self._pose[3:6]
        state.quaternion[0] = self._pose[6]
        state.base_velocity[:] = self._twist[:3]
        state.omega_base[:] = self._twist[3:]
        state.applied_torque[:3] = self._wrench[3:]
        return self._timebase.tick(stamp_ns)


class CommandCodec:
    """`Command` as /command: efforts of the base axes and the joints in one message."""

    def __init__(self, axis_names: Sequence[str], timebase: Timebase) -> None:
        self._timebase = timebase
        self._axes = JointStateCodec(
            topics.COMMAND, axis_names, topics.BASE_FRAME, fields=("effort",)
        )

    def encode(self, command: Command) -> bytes:
        """The bytes of /command, stamped with the state it answers."""
        self._axes.effort[:] = command.torque
        return self._axes.encode(self._timebase.stamp_ns(command.tick))

    def decode(self, data: bytes, command: Command) -> None:
        """Fill ``command``."""
        command.tick = self._timebase.tick(self._axes.decode(data))
        command.torque[:] = self._axes.effort


def xyz(value: Any) -> tuple[float, float, float]:
    """A Vector3 message's numbers."""
    return value.x, value.y, value.z


def transform_values(value: Any) -> tuple[float, ...]:
    """A Transform message's numbers: translation, quaternion x, y, z, w."""
    return (*xyz(value.translation), *xyz(value.rotation), value.rotation.w)


def twist_values(value: Any) -> tuple[float, ...]:
    """A Twist message's numbers: linear, angular."""
    return (*xyz(value.linear), *xyz(value.angular))


class ReferenceCodec:
    """`ReferenceChunk` of a fixed length as /reference/joints and /reference/base."""

    def __init__(self, joint_names: Sequence[str], timebase: Timebase, length: int) -> None:
        self._timebase, self._names, self._length = timebase, tuple(joint_names), length
        n = len(joint_names)
        builder = CdrBuilder()
        self._joints_stamp = builder.header_slot("")
        builder.strings(self._names)
        builder.uint32(length)
        rows = []
        for _ in range(length):
            # positions, velocities, accelerations, effort (empty), time_from_start
            row = [builder.float64_sequence_slot(n) for _ in range(3)]
            builder.float64_sequence_slot(0)
            rows.append((*row, builder.stamp_slot()))
        self._joints = builder.build()
        q, qd, qdd, after = zip(*rows, strict=True)
        self._q, self._qd, self._qdd = (self._joints.float64_rows(s) for s in (q, qd, qdd))
        self._write_offsets(self._joints.stamp_rows(after))

        builder = CdrBuilder()
        self._base_stamp = builder.header_slot(topics.INERTIAL_FRAME)
        builder.strings([topics.BASE_FRAME])
        builder.uint32(length)
        rows = []
        for _ in range(length):
            row = []
            for width in (7, 6, 6):  # Transform[1], Twist[1], Twist[1]
                builder.uint32(1)
                row.append(builder.float64_slot(width))
            rows.append((*row, builder.stamp_slot()))
        self._base = builder.build()
        pose, twist, accel, after = zip(*rows, strict=True)
        self._pose, self._twist, self._accel = (
            self._base.float64_rows(s) for s in (pose, twist, accel)
        )
        self._write_offsets(self._base.stamp_rows(after))

    def _write_offsets(self, rows: NDArray[np.int32]) -> None:
        for i, row in enumerate(rows):
            row[:] = divmod(self._timebase.stamp_ns(i), 1_000_000_000)

    def encode(self, chunk: ReferenceChunk) -> tuple[bytes, bytes]:
        """The bytes of /reference/joints and /reference/base."""
        stamp_ns = self._timebase.stamp_ns(chunk.start)
        self._q[:], self._qd[:] = chunk.joint_positions, chunk.joint_velocities
        self._qdd[:] = chunk.joint_accelerations
        self._pose[:, 3:6], self._pose[:, 6] = chunk.quaternion[:, 1:], chunk.quaternion[:, 0]
        self._twist[:, 3:], self._accel[:, 3:] = chunk.omega_base, chunk.omega_rate_base
        self._joints.set_stamp(self._joints_stamp, stamp_ns)
        self._base.set_stamp(self._base_stamp, stamp_ns)
        return self._joints.to_bytes(), self._base.to_bytes()


def decode_joint_reference(
    data: bytes, joint_names: Sequence[str], timebase: Timebase
) -> tuple[int, Array]:
    """First tick and (k, 3, n) positions, velocities, accelerations of a /reference/joints.

    Raises:
        ValueError: other joints than expected, or points not one tick apart.
    """
    name = topics.REFERENCE_JOINTS.name
    message = decode(data, topics.REFERENCE_JOINTS.type)
    order = _order(message.joint_names, joint_names, name)
    _check_spacing(message.points, timebase, name)
    rows = [(p.positions, p.velocities, p.accelerations) for p in message.points]
    values = np.array(rows, dtype=np.float64).reshape(len(rows), 3, len(order))
    return timebase.tick(_stamp(message)), values[:, :, order]


def decode_base_reference(data: bytes, timebase: Timebase) -> tuple[int, Array]:
    """First tick and (k, 10) quaternion (w first), omega, omega rate of a /reference/base."""
    message = decode(data, topics.REFERENCE_BASE.type)
    _check_spacing(message.points, timebase, topics.REFERENCE_BASE.name)
    values = np.empty((len(message.points), 10))
    for row, point in zip(values, message.points, strict=True):
        row[1:4], row[0] = xyz(point.transforms[0].rotation), point.transforms[0].rotation.w
        row[4:7] = xyz(point.velocities[0].angular)
        row[7:10] = xyz(point.accelerations[0].angular)
    return timebase.tick(_stamp(message)), values


def _check_spacing(points: Sequence[Any], timebase: Timebase, topic: str) -> None:
    for i, point in enumerate(points):
        after = point.time_from_start
        if after.sec * 1_000_000_000 + after.nanosec != timebase.stamp_ns(i):
            raise ValueError(f"{topic}: point {i} is not {i} ticks after its message's stamp")


class TelemetryCodec:
    """s, u, N_hat and e as a labelled Float64MultiArray; the padding before holds the tick."""

    ROWS = ("s", "u", "n_hat", "e")

    def __init__(self, axis_names: Sequence[str]) -> None:
        rows, columns = len(self.ROWS), len(axis_names)
        builder = CdrBuilder()
        builder.uint32(2)
        for label, size, stride in (
            ("signal: " + ", ".join(self.ROWS), rows, rows * columns),
            ("axis: " + ", ".join(axis_names), columns, columns),
        ):
            builder.string(label)
            builder.uint32(size)
            builder.uint32(stride)
        builder.uint32(1)  # data_offset: data[0] is the tick
        slot = builder.float64_sequence_slot(1 + rows * columns)
        self._message = builder.build()
        data = self._message.float64(slot)
        self._tick, self._values = data[:1], data[1:].reshape(rows, columns)

    def encode(self, tick: int, rows: Sequence[Array]) -> bytes:
        """The bytes of /controller/telemetry for the rows named by ``ROWS``."""
        self._tick[0] = tick
        for target, row in zip(self._values, rows, strict=True):
            target[:] = row
        return self._message.to_bytes()

    @staticmethod
    def decode(data: bytes) -> tuple[int, Array]:
        """Tick and (4, n+3) rows."""
        message = decode(data, topics.TELEMETRY.type)
        offset, shape = message.layout.data_offset, [dim.size for dim in message.layout.dim]
        return int(message.data[0]), message.data[offset:].reshape(shape)


class ClockCodec:
    """/clock."""

    def __init__(self) -> None:
        builder = CdrBuilder()
        self._stamp = builder.stamp_slot()
        self._message = builder.build()

    def encode(self, stamp_ns: int) -> bytes:
        """The bytes of /clock."""
        self._message.set_stamp(self._stamp, stamp_ns)
        return self._message.to_bytes()
