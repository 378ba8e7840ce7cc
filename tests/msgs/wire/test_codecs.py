"""Samples to messages and back, whatever the robot has, read and written by ROS and rosbags."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_samples import BASE_AXES, TIMEBASE, joint_names, ros_type, serialization
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import (
    ACTUATOR_FIELDS,
    MOST_PASSIVE,
    MOST_THRUSTERS,
    MOST_TORQUERS,
    MOST_WHEELS,
    PASSIVE_FIELDS,
    STATE_FIELDS,
    Command,
    LawInForce,
    ReferenceChunk,
    RobotNames,
    RobotState,
    Timebase,
)
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.telemetry import (
    ClockCodec,
    LawCodec,
    ReferenceCodec,
    TelemetryCodec,
    TruthWriter,
)

STORE = get_typestore(Stores.ROS2_JAZZY)


def names_of(
    joints: int,
    wheels: int = 0,
    thrusters: int = 0,
    passive: int = 0,
    geared: int = 0,
    torquers: int = 0,
) -> RobotNames:
    """The last joints are geared."""
    own = tuple(joint_names(joints))
    actuators = ("wheel", wheels), ("thruster", thrusters), ("torquer", torquers)
    named = (tuple(f"{kind}_{k + 1}" for k in range(count)) for kind, count in actuators)
    w, t, m = named
    panels = tuple(f"panel{'_' * (k % 3)}{k}" for k in range(passive))
    return RobotNames(own, w, t, panels, own[joints - min(geared, joints) :], torquers=m)


robots = st.builds(
    names_of,
    st.integers(1, 7),
    st.integers(0, MOST_WHEELS),
    st.integers(0, MOST_THRUSTERS),
    st.integers(0, MOST_PASSIVE),
    st.integers(0, 7),
    st.integers(0, MOST_TORQUERS),
)
seeds, ticks = st.integers(0, 2**32 - 1), st.integers(0, 4 * 10**9)


def state_of(names: RobotNames, seed: int = 0, tick: int = 7) -> RobotState:
    """A state with another number everywhere, zero where the robot has nothing."""
    rng, state = np.random.default_rng(seed), RobotState.allocate(len(names.joints))
    state.tick = tick
    for name in STATE_FIELDS:
        getattr(state, name)[:] = rng.normal(size=getattr(state, name).shape)
    wheels, geared, passive = len(names.wheels), len(names.geared), len(names.passive)
    counts = (wheels, wheels, len(names.thrusters), geared, geared)
    for name, count in zip(ACTUATOR_FIELDS, counts, strict=True):
        getattr(state, name)[:count] = rng.normal(size=count)
    for name in PASSIVE_FIELDS:
        getattr(state, name)[:passive] = rng.normal(size=passive)
    if names.torquers:
        state.magnetic_field[:] = rng.normal(size=3)
    return state


def encoded(names: RobotNames, state: RobotState) -> dict[topics.Topic, bytes]:
    codec = StateCodec(names, TIMEBASE)
    return dict(zip(codec.topics, codec.encode(state), strict=True))


@given(robots, seeds, ticks)
def test_a_state_comes_back_whole_whatever_the_robot_has(
    names: RobotNames, seed: int, tick: int
) -> None:
    """The same bits; of what it has not there is no message."""
    state, back = state_of(names, seed, tick), RobotState.allocate(len(names.joints))
    reader, sent = StateCodec(names, TIMEBASE), encoded(names, state)
    assert set(sent) == {
        *(topics.JOINT_STATES, topics.BASE_STATE),
        *([topics.WHEELS_STATE] if names.wheels else []),
        *([topics.THRUSTERS_STATE] if names.thrusters else []),
        *([topics.MOTORS_STATE] if names.geared else []),
        *([topics.MAGNETOMETER] if names.torquers else []),
    }
    for topic, data in sent.items():
        assert reader.decode(topic, data, back) == tick
    assert back.numbers.tobytes() == state.numbers.tobytes()


@given(robots, seeds, ticks, st.sampled_from([None, np.nan, np.inf, -0.0, 5e-324, 1.7e308]))
def test_a_command_comes_back_whole(
    names: RobotNames, seed: int, tick: int, odd: float | None
) -> None:
    torque = np.random.default_rng(seed).normal(size=len(names.commanded))
    torque[-1] = torque[-1] if odd is None else odd
    back = Command(-1, np.zeros_like(torque))
    data = CommandCodec(names.commanded, TIMEBASE).encode(Command(tick, torque))
    CommandCodec(names.commanded, TIMEBASE).decode(data, back)
    assert back.tick == tick
    assert back.torque.tobytes() == torque.tobytes()


def test_the_controller_waits_for_what_it_needs() -> None:
    """Not for thrusters and motors; the magnetometer is the last."""
    codec = StateCodec(names_of(3, 1, 1, 1, 2, 3), TIMEBASE)
    assert codec.control_topics == (
        topics.JOINT_STATES,
        topics.WHEELS_STATE,
        topics.BASE_STATE,
        topics.MAGNETOMETER,
    )
    assert topics.MAGNETOMETER.per_tick
    assert topics.MAGNETOMETER.is_optional


# Our bytes, other readers


def by_rclpy(data: bytes, type_name: str) -> Any:
    """The message as ROS reads it."""
    return serialization().deserialize_message(data, ros_type(type_name))


def by_rosbags(data: bytes, type_name: str) -> Any:
    return STORE.deserialize_cdr(data, type_name)


READERS = pytest.mark.parametrize("read", [by_rclpy, by_rosbags])


def tick_of(stamp: Any) -> int:
    return TIMEBASE.tick(stamp.sec * 10**9 + stamp.nanosec)


def test_frames_joints_without_motors_and_what_is_never_told() -> None:
    names = names_of(3, 3, 4, 2, 1, 2)
    state = state_of(names, tick=4001)
    message = {t: by_rosbags(data, t.type) for t, data in encoded(names, state).items()}
    assert {topic: one.header.frame_id for topic, one in message.items()} == {
        topics.JOINT_STATES: "",
        topics.BASE_STATE: topics.INERTIAL_FRAME,
        topics.WHEELS_STATE: topics.BASE_FRAME,
        topics.THRUSTERS_STATE: topics.BASE_FRAME,
        topics.MOTORS_STATE: "",
        topics.MAGNETOMETER: topics.BASE_FRAME,
    }
    joints = message[topics.JOINT_STATES]
    assert list(joints.name) == [*names.joints, *names.passive]
    passive = state.passive_positions[:2], state.passive_velocities[:2]
    np.testing.assert_array_equal(joints.position, [*state.joint_positions, *passive[0]])
    np.testing.assert_array_equal(joints.velocity, [*state.joint_velocities, *passive[1]])
    np.testing.assert_array_equal(joints.effort, [*state.applied_torque[3:], 0.0, 0.0])
    force = message[topics.BASE_STATE].wrench[0].force
    assert [force.x, force.y, force.z] == [0.0, 0.0, 0.0], "the base's position is uncontrolled"
    assert not np.any(message[topics.MAGNETOMETER].magnetic_field_covariance), "unknown"


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
    assert (message.clock.sec, message.clock.nanosec) == (12, 345_678_901)


@READERS
@pytest.mark.parametrize("is_first", [True, False])
def test_law_is_read_as_a_parameter_event(read: Any, is_first: bool) -> None:
    law = LawInForce(7, "tde_smc", {"h_bar": (1.5, 2.0), "lambda": (-0.0, 5e-324)}, is_first)
    message = read(LawCodec(TIMEBASE).encode(law), topics.LAW.type)
    assert tick_of(message.stamp) == 7
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


@settings(max_examples=50)
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
    data = LawCodec(TIMEBASE).encode(LawInForce(0, "ctc", {"k_p": (1.0,)}))
    with pytest.raises(MessageError, match="no parameter 'controller'"):
        LawCodec.decode(data.replace(b"controller\0", b"kontroller\0"), 0)
    at = data.index(b"ctc.k_p\0") + 8
    with pytest.raises(MessageError, match=r"ctc\.k_p is not a list of numbers"):
        LawCodec.decode(data[:at] + b"\x03" + data[at + 1 :], 0)


def test_the_truth_tells_all_joints() -> None:
    names = names_of(2, passive=3)
    writer, state = TruthWriter(names, TIMEBASE, topics.TRUTH), state_of(names, 4)
    assert writer.add(state) == ()
    (topic, data), _ = writer.flush()
    message = STORE.deserialize_cdr(data, topic.type)
    assert message.joint_names == [*names.axes, *names.passive]
    point = message.points[0]
    np.testing.assert_array_equal(point.positions[5:], state.passive_positions[:3])
    np.testing.assert_array_equal(point.velocities[3:5], state.joint_velocities)
    np.testing.assert_array_equal(point.velocities[5:], state.passive_velocities[:3])
    np.testing.assert_array_equal(point.effort, [*state.applied_torque, 0.0, 0.0, 0.0])


# Stamps


def test_every_message_begins_with_its_stamp() -> None:
    """So that a recorder can tell the tick without decoding."""
    names = names_of(2, 1, 1, 1, 1, 1)
    command = CommandCodec(BASE_AXES, TIMEBASE).encode(Command(9, np.zeros(3)))
    law = LawCodec(TIMEBASE).encode(LawInForce(9, "ctc", {}))
    states = encoded(names, state_of(names, tick=9)).values()
    for data in (*states, command, law, ClockCodec().encode(TIMEBASE.stamp_ns(9))):
        assert header_stamp_ns(data) == 4_500_000


@given(
    st.integers(0, 10**12),
    st.sampled_from([500_000, 1_000_000, 1, 333_333]),
    st.integers(1, 499_999),
)
def test_tick_to_stamp_and_back(tick: int, period_ns: int, offset: int) -> None:
    timebase = Timebase(period_ns)
    assert timebase.tick(timebase.stamp_ns(tick)) == tick
    assert timebase.period == pytest.approx(period_ns / 1e9, rel=1e-15)
    with pytest.raises(MessageError, match="same period"):
        TIMEBASE.tick(TIMEBASE.stamp_ns(tick) + offset)


# The desired motion as trajectory messages


def random_chunk(n: int, length: int, seed: int = 0, start: int = 100) -> ReferenceChunk:
    rng = np.random.default_rng(seed)
    return ReferenceChunk(start, rng.normal(size=(length, 3, n)), rng.normal(size=(length, 10)))


def assert_decodes_to(codec: ReferenceCodec, data: tuple[bytes, bytes], chunk: Any) -> None:
    start, joints = codec.decode_joints(data[0])
    assert start == chunk.start
    np.testing.assert_array_equal(joints, chunk.joints)
    start, base = codec.decode_base(data[1])
    assert start == chunk.start
    np.testing.assert_array_equal(base, chunk.base)


@settings(max_examples=40)
@given(
    st.integers(1, 9),
    st.lists(st.integers(1, 70), min_size=1, max_size=3),
    st.integers(0, 10**9),
    st.integers(0, 2**32 - 1),
)
def test_chunk_round_trip(n: int, lengths: list[int], start: int, seed: int) -> None:
    """Any number of joints, lengths that change from message to message."""
    writer, reader = (ReferenceCodec(joint_names(n), TIMEBASE) for _ in range(2))
    for length in lengths:
        chunk = random_chunk(n, length, seed, start)
        for _ in range(2):  # by the general decoder, then by the fast way
            assert_decodes_to(reader, writer.encode(chunk), chunk)


def test_points_more_than_a_second_apart_carry_into_the_seconds() -> None:
    data = ReferenceCodec(joint_names(2), Timebase(600_000_000)).encode(random_chunk(2, 4))
    after = [
        p.time_from_start
        for p in STORE.deserialize_cdr(data[0], topics.REFERENCE_JOINTS.type).points
    ]
    assert [t.sec * 10**9 + t.nanosec for t in after] == [600_000_000 * k for k in range(4)]
    assert [t.sec for t in after] == [0, 0, 1, 1]
