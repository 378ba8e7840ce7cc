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
from .errors import MessageError
from .samples import Command, RobotState, Timebase

Array = NDArray[np.float64]


def stamp_of(message: Any) -> int:
    """Header stamp of a decoded message, ns."""
    stamp = message.header.stamp
    return int(stamp.sec * 1_000_000_000 + stamp.nanosec)


def xyz(value: Any) -> tuple[float, float, float]:
    """A Vector3 message's numbers (or a Quaternion's first three)."""
    return value.x, value.y, value.z


def name_order(given: Sequence[str], expected: Sequence[str], topic: str) -> list[int]:
    """Where each expected name stands among the given ones.

    Raises:
        MessageError: other names than expected.
    """
    if sorted(given) != sorted(expected):
        raise MessageError(f"{topic}: names {list(given)}, expected {list(expected)}")
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
            MessageError: other joints than expected, or an array missing.
        """
        if self._message.load(data):
            return self._message.stamp_ns(self._stamp)
        message = decode(data, self._topic.type)
        order = name_order(message.name, self._names, self._topic.name)
        if order == sorted(order):
            self._lay_out(message.header.frame_id)  # same order: the next one is read fast
        for field in self._fields:
            values = getattr(message, field)
            if len(values) != len(self._names):
                raise MessageError(
                    f"{self._topic.name}: {len(values)} values of {field} "
                    f"for {len(self._names)} names"
                )
            getattr(self, field)[:] = values[order]
        return stamp_of(message)


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
            name_order(message.joint_names, [topics.BASE_FRAME], topics.BASE_STATE.name)
            if not (len(message.transforms) == len(message.twist) == len(message.wrench) == 1):
                raise MessageError(
                    f"{topics.BASE_STATE.name}: one transform, twist, wrench expected"
                )
            pose, twist = message.transforms[0], message.twist[0]
            self._pose[:] = (*xyz(pose.translation), *xyz(pose.rotation), pose.rotation.w)
            self._twist[:] = (*xyz(twist.linear), *xyz(twist.angular))
            self._wrench[3:] = xyz(message.wrench[0].torque)
            stamp_ns = stamp_of(message)
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
