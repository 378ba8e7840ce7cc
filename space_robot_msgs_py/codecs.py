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
from .compiled_cdr import FOREIGN, read_base, read_effort, read_joints, write_effort, write_state
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
        raise MessageError(f"{topic}: names {list(given)}, expected {list(expected)}", "names")
    return [list(given).index(name) for name in expected]


class JointStateMessage:
    """A sensor_msgs/JointState with the given names; ``fields`` says which arrays are filled."""

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
        stamp = builder.header_slot(frame_id)
        builder.strings(self._names)
        count = len(self._names)
        slots = {
            field: builder.float64_sequence_slot(count if field in self._fields else 0)
            for field in ("position", "velocity", "effort")
        }
        message = builder.build()
        self.block = message.block(stamp, **slots)
        """For the kernels."""
        self.to_bytes = message.to_bytes

    def decode(self, data: bytes) -> tuple[int, dict[str, Array]]:
        """Stamp in ns and arrays of a message in any layout, decoded the general way.

        Raises:
            MessageError: other joints than expected, or an array missing.
        """
        message = decode(data, self._topic.type)
        order = name_order(message.name, self._names, self._topic.name)
        if order == sorted(order):
            self._lay_out(message.header.frame_id)  # same order: the next one is read fast
        arrays = {}
        for field in self._fields:
            values = getattr(message, field)
            if len(values) != len(self._names):
                raise MessageError(
                    f"{self._topic.name}: {len(values)} values of {field} "
                    f"for {len(self._names)} names",
                    reason="size",
                )
            arrays[field] = values[order]
        return stamp_of(message), arrays


class StateCodec:
    """`RobotState` as the pair /joint_states and /base/state."""

    def __init__(self, joint_names: Sequence[str], timebase: Timebase) -> None:
        self._timebase = timebase
        self._joints = JointStateMessage(topics.JOINT_STATES, joint_names)
        builder = CdrBuilder()
        stamp = builder.header_slot(topics.INERTIAL_FRAME)
        builder.strings([topics.BASE_FRAME])
        slots = {}
        for name, width in (("pose", 7), ("twist", 6), ("wrench", 6)):
            builder.uint32(1)
            slots[name] = builder.float64_slot(width)
        self._base = builder.build()
        self._base_block = self._base.block(stamp, **slots)

    def encode(self, state: RobotState) -> tuple[bytes, bytes]:
        """The bytes of /joint_states and /base/state."""
        joints = self._joints
        write_state(
            joints.block, self._base_block, self._timebase.stamp_ns(state.tick),
            state.base_position, state.quaternion, state.base_velocity, state.omega_base,
            state.joint_positions, state.joint_velocities, state.applied_torque,
        )  # fmt: skip
        return joints.to_bytes(), self._base.to_bytes()

    def decode_joints(self, data: bytes, state: RobotState) -> int:
        """Fill the joints' part of ``state``; returns the tick."""
        stamp_ns = read_joints(
            self._joints.block, data, state.joint_positions, state.joint_velocities,
            state.applied_torque,
        )  # fmt: skip
        if stamp_ns == FOREIGN:
            stamp_ns, arrays = self._joints.decode(data)
            state.joint_positions[:] = arrays["position"]
            state.joint_velocities[:] = arrays["velocity"]
            state.applied_torque[3:] = arrays["effort"]
        return self._timebase.tick(stamp_ns)

    def decode_base(self, data: bytes, state: RobotState) -> int:
        """Fill the base's part of ``state``; returns the tick."""
        stamp_ns = read_base(
            self._base_block, data, state.base_position, state.quaternion,
            state.base_velocity, state.omega_base, state.applied_torque,
        )  # fmt: skip
        if stamp_ns == FOREIGN:
            message = decode(data, topics.BASE_STATE.type)
            name_order(message.joint_names, [topics.BASE_FRAME], topics.BASE_STATE.name)
            if not (len(message.transforms) == len(message.twist) == len(message.wrench) == 1):
                raise MessageError(
                    f"{topics.BASE_STATE.name}: one transform, twist, wrench expected"
                )
            pose, twist = message.transforms[0], message.twist[0]
            state.base_position[:] = xyz(pose.translation)
            state.quaternion[:] = (pose.rotation.w, *xyz(pose.rotation))
            state.base_velocity[:] = xyz(twist.linear)
            state.omega_base[:] = xyz(twist.angular)
            state.applied_torque[:3] = xyz(message.wrench[0].torque)
            stamp_ns = stamp_of(message)
        return self._timebase.tick(stamp_ns)


class CommandCodec:
    """`Command` as /command: efforts of the base axes and the joints in one message."""

    def __init__(self, axis_names: Sequence[str], timebase: Timebase) -> None:
        self._timebase = timebase
        self._axes = JointStateMessage(
            topics.COMMAND, axis_names, topics.BASE_FRAME, fields=("effort",)
        )

    def encode(self, command: Command) -> bytes:
        """The bytes of /command, stamped with the state it answers."""
        write_effort(self._axes.block, self._timebase.stamp_ns(command.tick), command.torque)
        return self._axes.to_bytes()

    def decode(self, data: bytes, command: Command) -> None:
        """Fill ``command``.

        Raises:
            MessageError: the message does not fit.
        """
        stamp_ns = read_effort(self._axes.block, data, command.torque)
        if stamp_ns == FOREIGN:
            stamp_ns, arrays = self._axes.decode(data)
            command.torque[:] = arrays["effort"]
        command.tick = self._timebase.tick(stamp_ns)


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
        """Tick and (4, n+3) rows.

        Raises:
            MessageError: the message does not fit.
        """
        message = decode(data, topics.TELEMETRY.type)
        offset, shape = message.layout.data_offset, [dim.size for dim in message.layout.dim]
        try:
            return int(message.data[0]), message.data[offset:].reshape(shape)
        except (IndexError, ValueError, OverflowError) as error:
            raise MessageError(f"{topics.TELEMETRY.name}: {error}") from None


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
