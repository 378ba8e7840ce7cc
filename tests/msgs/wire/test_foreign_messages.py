"""Joint states, base states and commands that other programs wrote, read by our codecs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_samples import (
    BASE,
    BASE_AXES,
    JOINTS,
    TIMEBASE,
    assert_same,
    joint_names,
    random_sample,
    ros_type,
    serialization,
    state_codec,
)

from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec


def foreign_joint_state(order: list[str], frame: str = "", **arrays: Any) -> bytes:
    """A JointState as any ROS node writes it, 2.0005 s."""
    message = ros_type("sensor_msgs/msg/JointState")(name=order, **arrays)
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = 2, 500_000
    return bytes(serialization().serialize_message(message))


@settings(max_examples=30)
@given(st.permutations(range(5)), st.sampled_from(["", "world", "inertial/x"]))
def test_joints_are_taken_by_name_whatever_order_and_frame(order: list[int], frame: str) -> None:
    names, reader = joint_names(5), state_codec(joint_names(5))
    for seed in (1, 2):  # the second message of one layout may take another way
        state, back = random_sample(5, seed), RobotState.allocate(5)
        data = foreign_joint_state(
            [names[i] for i in order],
            frame,
            position=state.joint_positions[order].tolist(),
            velocity=state.joint_velocities[order].tolist(),
            effort=state.applied_torque[3:][order].tolist(),
        )
        assert reader.decode(JOINTS, data, back) == 4001
        np.testing.assert_array_equal(back.joint_positions, state.joint_positions)
        np.testing.assert_array_equal(back.joint_velocities, state.joint_velocities)
        np.testing.assert_array_equal(back.applied_torque[3:], state.applied_torque[3:])
        own = state_codec(names).encode(state)[0]
        assert reader.decode(JOINTS, own, back) == 4001, "its own layout stays readable"


def foreign_base_state(state: RobotState, frame: str) -> bytes:
    message = ros_type("sensor_msgs/msg/MultiDOFJointState")(joint_names=["base"])
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = 2, 500_000
    transform, twist, wrench = (
        ros_type(f"geometry_msgs/msg/{name}")() for name in ("Transform", "Twist", "Wrench")
    )
    for part, values in (
        (transform.translation, state.base_position),
        (twist.linear, state.base_velocity),
        (transform.rotation, state.quaternion[1:]),
        (twist.angular, state.omega_base),
        (wrench.torque, state.applied_torque[:3]),
    ):
        part.x, part.y, part.z = values.tolist()
    transform.rotation.w = float(state.quaternion[0])
    message.transforms, message.twist, message.wrench = [transform], [twist], [wrench]
    return bytes(serialization().serialize_message(message))


@pytest.mark.parametrize("frame", ["inertial", "world", ""])
def test_base_state_of_a_foreign_writer_is_read(frame: str) -> None:
    state, back = random_sample(2, 3), RobotState.allocate(2)
    reader = state_codec(joint_names(2))
    assert reader.decode(BASE, foreign_base_state(state, frame), back) == 4001
    for name in ("base_position", "quaternion", "base_velocity", "omega_base"):
        np.testing.assert_array_equal(getattr(back, name), getattr(state, name), name)
    np.testing.assert_array_equal(back.applied_torque[:3], state.applied_torque[:3])


@pytest.mark.parametrize("fill", [0, 0x7F, 0xFF])
@pytest.mark.parametrize("tail", [1, 3, 8, 40])
def test_trailing_bytes_behind_the_own_layout_are_ignored(tail: int, fill: int) -> None:
    state, back = random_sample(2, 4), RobotState.allocate(2)
    codec, rest = state_codec(joint_names(2)), bytes([fill]) * tail
    joints, base = codec.encode(state)
    reader = state_codec(joint_names(2))
    assert reader.decode(JOINTS, joints + rest, back) == 4001
    assert reader.decode(BASE, base + rest, back) == 4001
    assert_same(back, state)


def test_command_of_a_foreign_writer_is_read_in_spite_of_the_bytes_behind() -> None:
    """Only efforts, as the paper's law sends them; empty arrays make rclpy's size too large."""
    axes, back = BASE_AXES + joint_names(2), Command(-1, np.zeros(5))
    data = foreign_joint_state(axes[::-1], effort=[5.0, 4.0, 3.0, 2.0, 1.0])
    CommandCodec(axes, TIMEBASE).decode(data, back)
    assert back.tick == 4001
    np.testing.assert_array_equal(back.torque, [1.0, 2.0, 3.0, 4.0, 5.0])


def test_trailing_bytes_behind_a_foreign_layout_are_ignored() -> None:
    numbers = {key: [1.0, 2.0] for key in ("position", "velocity", "effort")}
    data = foreign_joint_state(joint_names(2), "world", **numbers) + b"\xff" * 8
    assert state_codec(joint_names(2)).decode(JOINTS, data, RobotState.allocate(2)) == 4001


# What does not fit


@pytest.mark.parametrize("names", [["a", "c"], ["a"], ["a", "b", "c"], ["a", "a"]])
def test_other_names_are_errors_that_name_both(names: list[str]) -> None:
    reader = state_codec(["a", "b"])
    numbers = [1.0] * len(names)
    data = foreign_joint_state(names, "x", position=numbers, velocity=numbers, effort=numbers)
    with pytest.raises(MessageError, match=r"/joint_states.*expected \['a', 'b'\]") as caught:
        reader.decode(JOINTS, data, RobotState.allocate(2))
    assert isinstance(caught.value, ValueError)
    assert str(names) in str(caught.value)


def test_a_missing_array_is_an_error_that_names_it() -> None:
    reader = state_codec(["a", "b"])
    data = foreign_joint_state(["a", "b"], position=[1.0, 2.0], velocity=[1.0], effort=[1.0, 2.0])
    with pytest.raises(MessageError, match="/joint_states: 1 values of velocity for 2 names"):
        reader.decode(JOINTS, data, RobotState.allocate(2))
    good = state_codec(["a", "b"]).encode(random_sample(2, 5))[0]
    assert reader.decode(JOINTS, good, RobotState.allocate(2)) == 4001, "and the next one is read"


def test_base_state_without_a_transform_is_an_error() -> None:
    message = ros_type("sensor_msgs/msg/MultiDOFJointState")(joint_names=["base"])
    data = bytes(serialization().serialize_message(message))
    with pytest.raises(MessageError, match="/base/state: one transform, twist, wrench"):
        state_codec(["a"]).decode(BASE, data, RobotState.allocate(1))
