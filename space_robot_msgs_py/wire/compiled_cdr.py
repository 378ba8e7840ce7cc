"""FieldReader into fixed-layout messages and out of them, in compiled code.

A message is the (1,) structured array of `FixedMessage.block`. What differs from its layout is
left alone and told by `FOREIGN`: it is then decoded the general way.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compiled.kernels import kernel, subroutine

Array = NDArray[np.float64]
Block = NDArray[Any]

FOREIGN = -1
"""In place of a stamp: the message is laid out otherwise."""
_BILLION = 1_000_000_000


@subroutine
def receive(message: Any, data: bytes) -> int:
    """Copy a serialized message into ``message`` if its layout is the same; its stamp, ns.

    Bytes behind the message are ignored: foreign writers leave some there.
    """
    size = message.wire.size
    if len(data) < size:
        return FOREIGN
    differing = np.uint8(0)
    for i in range(size):
        differing |= (data[i] ^ message.layout[i]) & message.constant[i]
    if differing != 0:
        return FOREIGN
    for i in range(size):
        message.wire[i] = data[i]
    seconds: Any = np.int64(message.sec)
    return seconds * _BILLION + message.nanosec  # type: ignore[no-any-return]


@subroutine
def set_stamp(message: Any, stamp_ns: int) -> None:
    """Write the stamp."""
    message.sec = stamp_ns // _BILLION
    message.nanosec = stamp_ns % _BILLION


@subroutine
def copy(source: Array, start: int, target: Array, at: int, count: int) -> None:
    """``target[at:at+count] = source[start:start+count]``: slices take longer to compile."""
    for i in range(count):
        target[at + i] = source[start + i]


@kernel
def write_state(
    joints_block: Block, base_block: Block, stamp_ns: int, base_position: Array,
    quaternion: Array, base_velocity: Array, omega_base: Array, joint_positions: Array,
    joint_velocities: Array, applied_torque: Array,
) -> None:  # fmt: skip
    """A `RobotState` into its two messages."""
    joints, base = joints_block[0], base_block[0]
    set_stamp(joints, stamp_ns)
    set_stamp(base, stamp_ns)
    copy(joint_positions, 0, joints.position, 0, joint_positions.size)
    copy(joint_velocities, 0, joints.velocity, 0, joint_velocities.size)
    copy(applied_torque, 3, joints.effort, 0, joint_positions.size)
    copy(base_position, 0, base.pose, 0, 3)
    copy(quaternion, 1, base.pose, 3, 3)
    base.pose[6] = quaternion[0]
    copy(base_velocity, 0, base.twist, 0, 3)
    copy(omega_base, 0, base.twist, 3, 3)
    copy(applied_torque, 0, base.wrench, 3, 3)


@kernel
def read_joints(
    block: Block, data: bytes, joint_positions: Array, joint_velocities: Array,
    applied_torque: Array,
) -> int:  # fmt: skip
    """The joints' part of a `RobotState`; its stamp, ns, or `FOREIGN`."""
    message = block[0]
    stamp_ns: int = receive(message, data)
    if stamp_ns != FOREIGN:
        copy(message.position, 0, joint_positions, 0, joint_positions.size)
        copy(message.velocity, 0, joint_velocities, 0, joint_velocities.size)
        copy(message.effort, 0, applied_torque, 3, joint_positions.size)
    return stamp_ns


@kernel
def read_base(
    block: Block, data: bytes, base_position: Array, quaternion: Array, base_velocity: Array,
    omega_base: Array, applied_torque: Array,
) -> int:  # fmt: skip
    """The base's part of a `RobotState`; its stamp, ns, or `FOREIGN`."""
    message = block[0]
    stamp_ns: int = receive(message, data)
    if stamp_ns != FOREIGN:
        copy(message.pose, 0, base_position, 0, 3)
        copy(message.pose, 3, quaternion, 1, 3)
        quaternion[0] = message.pose[6]
        copy(message.twist, 0, base_velocity, 0, 3)
        copy(message.twist, 3, omega_base, 0, 3)
        copy(message.wrench, 3, applied_torque, 0, 3)
    return stamp_ns


@kernel
def write_effort(block: Block, stamp_ns: int, effort: Array) -> None:
    """A stamp and efforts."""
    message = block[0]
    set_stamp(message, stamp_ns)
    copy(effort, 0, message.effort, 0, effort.size)


@kernel
def read_effort(block: Block, data: bytes, effort: Array) -> int:
    """The efforts of a JointState; its stamp, ns, or `FOREIGN`."""
    message = block[0]
    stamp_ns: int = receive(message, data)
    if stamp_ns != FOREIGN:
        copy(message.effort, 0, effort, 0, effort.size)
    return stamp_ns
