"""Samples to messages and back, read and written by rclpy and rosbags as well."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.cdr import header_stamp_ns
from space_robot_msgs_py.codecs import ClockCodec, CommandCodec, StateCodec, TelemetryCodec
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Command, RobotState, Timebase

Array = NDArray[np.float64]

STORE = get_typestore(Stores.ROS2_JAZZY)
TIMEBASE = Timebase(500_000)
BASE_AXES = ["base_x", "base_y", "base_z"]


def joint_names(n: int) -> list[str]:
    """Of different lengths, so that everything behind them is aligned differently."""
    return [f"j{'x' * (i * n % 5)}{i}" for i in range(n)]


def random_sample(n: int, seed: int, tick: int = 4001) -> RobotState:
    rng = np.random.default_rng(seed)
    state = RobotState.allocate(n)
    state.tick = tick
    for name in RobotState.__slots__[1:]:
        getattr(state, name)[:] = rng.normal(size=getattr(state, name).shape)
    return state


def assert_same(actual: RobotState, expected: RobotState) -> None:
    for name in RobotState.__slots__[1:]:
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name), name)


def by_rclpy(data: bytes, type_name: str) -> Any:
    """The message as ROS reads it."""
    return serialization().deserialize_message(data, ros_type(type_name))


def serialization() -> Any:
    return pytest.importorskip("rclpy.serialization")


def ros_type(type_name: str) -> Any:
    package, _, name = type_name.split("/")
    return getattr(pytest.importorskip(f"{package}.msg"), name)


def by_rosbags(data: bytes, type_name: str) -> Any:
    return STORE.deserialize_cdr(data, type_name)


READERS = pytest.mark.parametrize("read", [by_rclpy, by_rosbags])


def xyz(value: Any) -> list[float]:
    return [value.x, value.y, value.z]


def seconds(stamp: Any) -> tuple[int, int]:
    return stamp.sec, stamp.nanosec


# Our bytes, other readers


@READERS
@pytest.mark.parametrize("n", [1, 2, 6, 7])
def test_state_is_read_as_ros_messages(n: int, read: Any) -> None:
    """JointState's effort and the wrench echo the applied torque; quaternions are x, y, z, w."""
    state = random_sample(n, seed=n)
    joints_data, base_data = StateCodec(joint_names(n), TIMEBASE).encode(state)
    joints = read(joints_data, "sensor_msgs/msg/JointState")
    assert seconds(joints.header.stamp) == (2, 500_000)
    assert list(joints.name) == joint_names(n)
    np.testing.assert_array_equal(joints.position, state.joint_positions)
    np.testing.assert_array_equal(joints.velocity, state.joint_velocities)
    np.testing.assert_array_equal(joints.effort, state.applied_torque[3:])
    base = read(base_data, "sensor_msgs/msg/MultiDOFJointState")
    assert seconds(base.header.stamp) == (2, 500_000)
    assert base.header.frame_id == topics.INERTIAL_FRAME
    assert list(base.joint_names) == [topics.BASE_FRAME]
    (transform,), (twist,), (wrench,) = base.transforms, base.twist, base.wrench
    assert xyz(transform.translation) == state.base_position.tolist()
    assert [transform.rotation.w, *xyz(transform.rotation)] == state.quaternion.tolist()
    assert xyz(twist.linear) == state.base_velocity.tolist()
    assert xyz(twist.angular) == state.omega_base.tolist()
    assert xyz(wrench.torque) == state.applied_torque[:3].tolist()
    assert xyz(wrench.force) == [0.0, 0.0, 0.0], "the base's position is left uncontrolled"


@READERS
def test_command_is_read_as_a_joint_state_of_efforts(read: Any) -> None:
    axes, torque = BASE_AXES + joint_names(3), np.arange(6.0) - 2.5
    data = CommandCodec(axes, TIMEBASE).encode(Command(7, torque))
    message = read(data, "sensor_msgs/msg/JointState")
    assert seconds(message.header.stamp) == (0, 3_500_000)
    assert list(message.name) == axes
    np.testing.assert_array_equal(message.effort, torque)
    assert len(message.position) == len(message.velocity) == 0


@READERS
def test_telemetry_is_read_as_a_labelled_array(read: Any) -> None:
    """Rows s, u, n_hat, e behind the tick, as the layout says."""
    axes, rows = BASE_AXES + joint_names(2), np.arange(20.0).reshape(4, 5)
    data = TelemetryCodec(axes).encode(123_456_789, list(rows))
    message = read(data, "std_msgs/msg/Float64MultiArray")
    signal, axis = message.layout.dim
    assert signal.label.split(": ")[1].split(", ") == ["s", "u", "n_hat", "e"]
    assert axis.label.split(": ")[1].split(", ") == axes
    assert (signal.size, signal.stride, axis.size, axis.stride) == (4, 20, 5, 5)
    offset = message.layout.data_offset
    assert list(message.data[:offset]) == [123_456_789.0]
    np.testing.assert_array_equal(np.reshape(message.data[offset:], (4, 5)), rows)
    tick, decoded = TelemetryCodec.decode(data)
    assert tick == 123_456_789
    np.testing.assert_array_equal(decoded, rows)


@READERS
def test_clock_is_read_as_a_clock(read: Any) -> None:
    message = read(ClockCodec().encode(12_345_678_901), "rosgraph_msgs/msg/Clock")
    assert seconds(message.clock) == (12, 345_678_901)


def test_every_message_begins_with_its_stamp() -> None:
    """So that a recorder can tell the tick without decoding."""
    joints, base = StateCodec(joint_names(2), TIMEBASE).encode(random_sample(2, 1, tick=9))
    command = CommandCodec(BASE_AXES, TIMEBASE).encode(Command(9, np.zeros(3)))
    for data in (joints, base, command, ClockCodec().encode(TIMEBASE.stamp_ns(9))):
        assert header_stamp_ns(data) == 4_500_000


# Round trips


@given(st.integers(1, 9), st.integers(0, 2**32 - 1), st.integers(0, 4 * 10**9))
def test_state_round_trip(n: int, seed: int, tick: int) -> None:
    """Any number of joints, any tick: the same bits come back."""
    state, back = random_sample(n, seed, tick), RobotState.allocate(n)
    joints, base = StateCodec(joint_names(n), TIMEBASE).encode(state)
    reader = StateCodec(joint_names(n), TIMEBASE)
    assert reader.decode_joints(joints, back) == reader.decode_base(base, back) == tick
    assert_same(back, state)


@given(st.integers(1, 9), st.integers(0, 2**32 - 1), st.integers(0, 4 * 10**9))
def test_command_round_trip(n: int, seed: int, tick: int) -> None:
    torque = np.random.default_rng(seed).normal(size=n + 3)
    axes, back = BASE_AXES + joint_names(n), Command(-1, np.zeros(n + 3))
    CommandCodec(axes, TIMEBASE).decode(
        CommandCodec(axes, TIMEBASE).encode(Command(tick, torque)), back
    )
    assert back.tick == tick
    np.testing.assert_array_equal(back.torque, torque)


def test_decoded_samples_do_not_change_with_the_next_message() -> None:
    """The codec's buffer is its own."""
    writer, reader = (StateCodec(joint_names(2), TIMEBASE) for _ in range(2))
    first, back = random_sample(2, 1), RobotState.allocate(2)
    joints, base = writer.encode(first)
    reader.decode_joints(joints, back)
    reader.decode_base(base, back)
    for data in writer.encode(random_sample(2, 2)):
        assert data not in (joints, base)
    reader.decode_joints(writer.encode(random_sample(2, 3))[0], RobotState.allocate(2))
    assert_same(back, first)


@pytest.mark.parametrize("value", [np.nan, np.inf, -0.0, 5e-324, 1.7e308])
def test_odd_numbers_survive(value: float) -> None:
    axes, back = BASE_AXES, Command(0, np.zeros(3))
    CommandCodec(axes, TIMEBASE).decode(
        CommandCodec(axes, TIMEBASE).encode(Command(0, np.full(3, value))), back
    )
    assert back.torque.tobytes() == np.full(3, value).tobytes()


# Others' bytes, our reader


def foreign_joint_state(order: list[str], frame: str = "", **arrays: Any) -> bytes:
    """A JointState as any ROS node writes it, 2.0005 s."""
    message = ros_type("sensor_msgs/msg/JointState")(name=order, **arrays)
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = 2, 500_000
    return bytes(serialization().serialize_message(message))


@settings(max_examples=30)
@given(st.permutations(range(5)), st.sampled_from(["", "world", "inertial/x"]))
def test_joints_are_taken_by_name_whatever_order_and_frame(order: list[int], frame: str) -> None:
    names, reader = joint_names(5), StateCodec(joint_names(5), TIMEBASE)
    for seed in (1, 2):  # the second message of one layout may take another way
        state, back = random_sample(5, seed), RobotState.allocate(5)
        data = foreign_joint_state(
            [names[i] for i in order], frame,
            position=state.joint_positions[order].tolist(),
            velocity=state.joint_velocities[order].tolist(),
            effort=state.applied_torque[3:][order].tolist(),
        )  # fmt: skip
        assert reader.decode_joints(data, back) == 4001
        np.testing.assert_array_equal(back.joint_positions, state.joint_positions)
        np.testing.assert_array_equal(back.joint_velocities, state.joint_velocities)
        np.testing.assert_array_equal(back.applied_torque[3:], state.applied_torque[3:])
        own = StateCodec(names, TIMEBASE).encode(state)[0]
        assert reader.decode_joints(own, back) == 4001, "its own layout stays readable"


def foreign_base_state(state: RobotState, frame: str) -> bytes:
    message = ros_type("sensor_msgs/msg/MultiDOFJointState")(joint_names=["base"])
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = 2, 500_000
    transform, twist, wrench = (
        ros_type(f"geometry_msgs/msg/{name}")() for name in ("Transform", "Twist", "Wrench")
    )
    for part, values in (
        (transform.translation, state.base_position), (twist.linear, state.base_velocity),
        (transform.rotation, state.quaternion[1:]), (twist.angular, state.omega_base),
        (wrench.torque, state.applied_torque[:3]),
    ):  # fmt: skip
        part.x, part.y, part.z = values.tolist()
    transform.rotation.w = float(state.quaternion[0])
    message.transforms, message.twist, message.wrench = [transform], [twist], [wrench]
    return bytes(serialization().serialize_message(message))


@pytest.mark.parametrize("frame", ["inertial", "world", ""])
def test_base_state_of_a_foreign_writer_is_read(frame: str) -> None:
    state, back = random_sample(2, 3), RobotState.allocate(2)
    reader = StateCodec(joint_names(2), TIMEBASE)
    assert reader.decode_base(foreign_base_state(state, frame), back) == 4001
    for name in ("base_position", "quaternion", "base_velocity", "omega_base"):
        np.testing.assert_array_equal(getattr(back, name), getattr(state, name), name)
    np.testing.assert_array_equal(back.applied_torque[:3], state.applied_torque[:3])


@pytest.mark.parametrize("fill", [0, 0x7F, 0xFF])
@pytest.mark.parametrize("tail", [1, 3, 8, 40])
def test_trailing_bytes_behind_the_own_layout_are_ignored(tail: int, fill: int) -> None:
    state, back = random_sample(2, 4), RobotState.allocate(2)
    codec, rest = StateCodec(joint_names(2), TIMEBASE), bytes([fill]) * tail
    joints, base = codec.encode(state)
    reader = StateCodec(joint_names(2), TIMEBASE)
    assert reader.decode_joints(joints + rest, back) == 4001
    assert reader.decode_base(base + rest, back) == 4001
    assert_same(back, state)


OVERESTIMATE = pytest.mark.xfail(
    strict=True,
    reason="rosbags refuses the 4 and more bytes that rclpy's serialize_message leaves behind",
)


@OVERESTIMATE
def test_command_of_a_foreign_writer_is_read_in_spite_of_the_bytes_behind() -> None:
    """Only efforts, as the paper's law sends them; empty arrays make rclpy's size too large."""
    axes, back = BASE_AXES + joint_names(2), Command(-1, np.zeros(5))
    data = foreign_joint_state(axes[::-1], effort=[5.0, 4.0, 3.0, 2.0, 1.0])
    CommandCodec(axes, TIMEBASE).decode(data, back)
    assert back.tick == 4001
    np.testing.assert_array_equal(back.torque, [1.0, 2.0, 3.0, 4.0, 5.0])


@OVERESTIMATE
def test_trailing_bytes_behind_a_foreign_layout_are_ignored() -> None:
    numbers = {key: [1.0, 2.0] for key in ("position", "velocity", "effort")}
    data = foreign_joint_state(joint_names(2), "world", **numbers) + b"\xff" * 8
    assert StateCodec(joint_names(2), TIMEBASE).decode_joints(data, RobotState.allocate(2)) == 4001


# What does not fit


@pytest.mark.parametrize("names", [["a", "c"], ["a"], ["a", "b", "c"], ["a", "a"]])
def test_other_names_are_errors_that_name_both(names: list[str]) -> None:
    reader = StateCodec(["a", "b"], TIMEBASE)
    numbers = [1.0] * len(names)
    data = foreign_joint_state(names, "x", position=numbers, velocity=numbers, effort=numbers)
    with pytest.raises(MessageError, match=r"/joint_states.*expected \['a', 'b'\]") as caught:
        reader.decode_joints(data, RobotState.allocate(2))
    assert isinstance(caught.value, ValueError)
    assert str(names) in str(caught.value)


def test_a_missing_array_is_an_error_that_names_it() -> None:
    reader = StateCodec(["a", "b"], TIMEBASE)
    data = foreign_joint_state(["a", "b"], position=[1.0, 2.0], velocity=[1.0], effort=[1.0, 2.0])
    with pytest.raises(MessageError, match="/joint_states: 1 values of velocity for 2 names"):
        reader.decode_joints(data, RobotState.allocate(2))
    good = StateCodec(["a", "b"], TIMEBASE).encode(random_sample(2, 5))[0]
    assert reader.decode_joints(good, RobotState.allocate(2)) == 4001, "and the next one is read"


def test_base_state_without_a_transform_is_an_error() -> None:
    message = ros_type("sensor_msgs/msg/MultiDOFJointState")(joint_names=["base"])
    data = bytes(serialization().serialize_message(message))
    with pytest.raises(MessageError, match="/base/state: one transform, twist, wrench"):
        StateCodec(["a"], TIMEBASE).decode_base(data, RobotState.allocate(1))


def test_a_state_of_another_period_is_an_error() -> None:
    joints, base = StateCodec(["a"], TIMEBASE).encode(random_sample(1, 6, tick=3))
    reader, back = StateCodec(["a"], Timebase(1_000_000)), RobotState.allocate(1)
    for decode, data in ((reader.decode_joints, joints), (reader.decode_base, base)):
        with pytest.raises(MessageError, match="1500000 ns is not a whole number of 1000000 ns"):
            decode(data, back)


# Timebase


@given(st.integers(0, 10**12), st.sampled_from([500_000, 1_000_000, 1, 333_333]))
def test_tick_to_stamp_and_back(tick: int, period_ns: int) -> None:
    timebase = Timebase(period_ns)
    assert timebase.tick(timebase.stamp_ns(tick)) == tick
    assert timebase.period == pytest.approx(period_ns / 1e9, rel=1e-15)


@given(st.integers(0, 10**12), st.integers(1, 499_999))
def test_a_stamp_between_ticks_is_an_error(tick: int, offset: int) -> None:
    with pytest.raises(MessageError, match="same period"):
        TIMEBASE.tick(TIMEBASE.stamp_ns(tick) + offset)
