"""Samples to messages and back, read and written by rclpy and rosbags as well."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
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
from rosbags.typesys import Stores, get_typestore
from strategies import JOINTS as JOINT_COUNTS

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Command, LawInForce, RobotState, Timebase
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.clock import ClockCodec
from space_robot_msgs_py.wire.codecs import CommandCodec
from space_robot_msgs_py.wire.controller_law import LawCodec
from space_robot_msgs_py.wire.controller_telemetry import TelemetryCodec

Array = NDArray[np.float64]

STORE = get_typestore(Stores.ROS2_JAZZY)


def by_rclpy(data: bytes, type_name: str) -> Any:
    """The message as ROS reads it."""
    return serialization().deserialize_message(data, ros_type(type_name))


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
    joints_data, base_data = state_codec(joint_names(n)).encode(state)
    joints = read(joints_data, "sensor_msgs/msg/JointState")
    assert seconds(joints.header.stamp) == (2, 500_000)
    assert list(joints.name) == joint_names(n)
    np.testing.assert_array_equal(joints.position, state.joint_positions)
    np.testing.assert_array_equal(joints.velocity, state.joint_velocities)
    np.testing.assert_array_equal(joints.effort, state.applied_torque[3:])
    base = read(base_data, "sensor_msgs/msg/MultiDOFJointState")
    assert seconds(base.header.stamp) == (2, 500_000)
    assert base.header.frame_id == topics.INERTIAL_FRAME
    assert list(base.joint_names) == [topics.BASE_JOINT]
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


@READERS
@pytest.mark.parametrize("is_first", [True, False])
def test_law_is_read_as_a_parameter_event(read: Any, is_first: bool) -> None:
    law = LawInForce(7, "tde_smc", {"h_bar": (1.5, 2.0), "lambda": (-0.0, 5e-324)}, is_first)
    data = LawCodec(TIMEBASE).encode(law)
    message = read(data, topics.LAW.type)
    assert seconds(message.stamp) == (0, 3_500_000)
    assert message.node == "/controller_node"
    given, other = message.new_parameters, message.changed_parameters
    given, other = (given, other) if is_first else (other, given)
    assert len(other) == len(message.deleted_parameters) == 0
    assert [p.name for p in given] == ["controller", "tde_smc.h_bar", "tde_smc.lambda"]
    assert [p.value.type for p in given] == [4, 8, 8]
    assert given[0].value.string_value == "tde_smc"
    for parameter, values in zip(given[1:], law.gains.values(), strict=True):
        sent = np.array(parameter.value.double_array_value)
        assert sent.tobytes() == np.array(values).tobytes()


@given(
    st.text(min_size=1, max_size=9).filter(lambda name: "\0" not in name),
    st.dictionaries(st.text("abc_1.", min_size=1), st.lists(st.floats(), max_size=9), max_size=5),
    st.booleans(),
)
def test_law_round_trip(name: str, gains: dict[str, list[float]], is_first: bool) -> None:
    """Whatever names and numbers: the same bits come back, from our bytes and from ROS's."""
    law = LawInForce(3, name, {k: tuple(v) for k, v in gains.items()}, is_first)
    data = LawCodec(TIMEBASE).encode(law)
    theirs = serialization().serialize_message(by_rclpy(data, topics.LAW.type))
    assert repr(LawCodec.decode(data, 3)) == repr(LawCodec.decode(theirs, 3)) == repr(law)


def test_a_parameter_event_that_names_no_law_is_an_error() -> None:
    law = LawInForce(0, "ctc", {"k_p": (1.0,)})
    data = LawCodec(TIMEBASE).encode(law)
    with pytest.raises(MessageError, match="no parameter 'controller'"):
        LawCodec.decode(data.replace(b"controller\0", b"kontroller\0"), 0)
    at = data.index(b"ctc.k_p\0") + 8
    with pytest.raises(MessageError, match=r"ctc\.k_p is not a list of numbers"):
        LawCodec.decode(data[:at] + b"\x03" + data[at + 1 :], 0)


def test_every_message_begins_with_its_stamp() -> None:
    """So that a recorder can tell the tick without decoding."""
    joints, base = state_codec(joint_names(2)).encode(random_sample(2, 1, tick=9))
    command = CommandCodec(BASE_AXES, TIMEBASE).encode(Command(9, np.zeros(3)))
    law = LawCodec(TIMEBASE).encode(LawInForce(9, "ctc", {}))
    for data in (joints, base, command, law, ClockCodec().encode(TIMEBASE.stamp_ns(9))):
        assert header_stamp_ns(data) == 4_500_000


# Round trips


@given(st.sampled_from(JOINT_COUNTS), st.integers(0, 2**32 - 1), st.integers(0, 4 * 10**9))
def test_state_round_trip(n: int, seed: int, tick: int) -> None:
    """Any number of joints, any tick: the same bits come back."""
    state, back = random_sample(n, seed, tick), RobotState.allocate(n)
    joints, base = state_codec(joint_names(n)).encode(state)
    reader = state_codec(joint_names(n))
    assert reader.decode(JOINTS, joints, back) == reader.decode(BASE, base, back) == tick
    assert_same(back, state)


@given(st.sampled_from(JOINT_COUNTS), st.integers(0, 2**32 - 1), st.integers(0, 4 * 10**9))
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
    writer, reader = (state_codec(joint_names(2)) for _ in range(2))
    first, back = random_sample(2, 1), RobotState.allocate(2)
    joints, base = writer.encode(first)
    reader.decode(JOINTS, joints, back)
    reader.decode(BASE, base, back)
    for data in writer.encode(random_sample(2, 2)):
        assert data not in (joints, base)
    reader.decode(
        topics.JOINT_STATES, writer.encode(random_sample(2, 3))[0], RobotState.allocate(2)
    )
    assert_same(back, first)


@pytest.mark.parametrize("value", [np.nan, np.inf, -0.0, 5e-324, 1.7e308])
def test_odd_numbers_survive(value: float) -> None:
    axes, back = BASE_AXES, Command(0, np.zeros(3))
    CommandCodec(axes, TIMEBASE).decode(
        CommandCodec(axes, TIMEBASE).encode(Command(0, np.full(3, value))), back
    )
    assert back.torque.tobytes() == np.full(3, value).tobytes()


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


def test_a_state_of_another_period_is_an_error() -> None:
    joints, base = state_codec(["a"]).encode(random_sample(1, 6, tick=3))
    reader, back = state_codec(["a"], Timebase(1_000_000)), RobotState.allocate(1)
    for topic, data in ((topics.JOINT_STATES, joints), (topics.BASE_STATE, base)):
        with pytest.raises(MessageError, match="1500000 ns is not a whole number of 1000000 ns"):
            reader.decode(topic, data, back)
