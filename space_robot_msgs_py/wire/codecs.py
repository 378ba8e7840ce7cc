"""Samples to messages and back: one codec a topic, on the fixed layouts of `cdr`.

A codec encodes into bytes that any ROS 2 tool reads. It decodes its own layout by copying
bytes, and any other valid message of the type (another frame, other lengths of unused fields,
joints in another order) by way of the general decoder.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import Command, RobotState, Timebase
from .cdr import CdrBuilder
from .compiled_cdr import FOREIGN, read_base, read_effort, read_joints, write_effort, write_state
from .decoded import name_order, stamp_of, xyz
from .definitions import decode

Array = NDArray[np.float64]


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
