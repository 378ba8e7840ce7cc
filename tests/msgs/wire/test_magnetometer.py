"""/magnetometer: the field at a base with magnetic torquers, and commands to these."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_samples import TIMEBASE, assert_same, joint_names, ros_type, serialization
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import MOST_TORQUERS, STATE_FIELDS, Command, RobotNames, RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec

STORE = get_typestore(Stores.ROS2_JAZZY)
FIELDS = st.lists(st.floats(allow_nan=False), min_size=3, max_size=3)


def names_of(joints: int, torquers: int) -> RobotNames:
    return RobotNames(
        tuple(joint_names(joints)), torquers=tuple(f"torquer_{k + 1}" for k in range(torquers))
    )


def state_of(names: RobotNames, seed: int = 0, tick: int = 7) -> RobotState:
    """Return a state with another number everywhere, also of the field."""
    rng, state = np.random.default_rng(seed), RobotState.allocate(len(names.joints))
    state.tick = tick
    for name in (*STATE_FIELDS, "magnetic_field"):
        getattr(state, name)[:] = rng.normal(size=getattr(state, name).shape)
    return state


@given(
    st.integers(1, 7),
    st.integers(0, MOST_TORQUERS),
    FIELDS,
    st.integers(0, 2**32 - 1),
    st.integers(0, 4 * 10**9),
)
def test_a_state_comes_back_with_the_field_if_there_are_torquers(
    joints: int, torquers: int, field: list[float], seed: int, tick: int
) -> None:
    names = names_of(joints, torquers)
    state, back = state_of(names, seed, tick), RobotState.allocate(joints)
    state.magnetic_field[:] = field
    writer, reader = StateCodec(names, TIMEBASE), StateCodec(names, TIMEBASE)
    assert (topics.MAGNETOMETER in writer.topics) is bool(torquers)
    for topic, data in zip(writer.topics, writer.encode(state), strict=True):
        assert reader.decode(topic, data, back) == tick
    assert_same(back, state)
    np.testing.assert_array_equal(back.magnetic_field, field if torquers else np.zeros(3))


def sent(names: RobotNames, state: RobotState) -> bytes:
    codec = StateCodec(names, TIMEBASE)
    return dict(zip(codec.topics, codec.encode(state), strict=True))[topics.MAGNETOMETER]


def test_other_software_reads_a_magnetic_field_on_base_axes() -> None:
    """Its covariance is zero, which means unknown."""
    names = names_of(2, 3)
    state = state_of(names, 1)
    message = STORE.deserialize_cdr(sent(names, state), topics.MAGNETOMETER.type)
    assert topics.MAGNETOMETER.type == "sensor_msgs/msg/MagneticField"
    assert message.header.frame_id == topics.BASE_FRAME
    stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    assert TIMEBASE.tick(stamp) == 7
    field = message.magnetic_field
    np.testing.assert_array_equal([field.x, field.y, field.z], state.magnetic_field)
    np.testing.assert_array_equal(message.magnetic_field_covariance, np.zeros(9))


def test_ros_reads_it_and_is_read() -> None:
    """Whatever the bytes between frame and numbers, which ROS leaves as they are."""
    names = names_of(3, 1)
    state, back = state_of(names, 2), RobotState.allocate(3)
    data = sent(names, state)
    ros = serialization().deserialize_message(data, ros_type(topics.MAGNETOMETER.type))
    field = ros.magnetic_field
    np.testing.assert_array_equal([field.x, field.y, field.z], state.magnetic_field)
    again = serialization().serialize_message(ros)
    assert StateCodec(names, TIMEBASE).decode(topics.MAGNETOMETER, again, back) == 7
    np.testing.assert_array_equal(back.magnetic_field, state.magnetic_field)


@pytest.mark.parametrize("frame", ["", "magnetometer_on_a_boom"])
def test_a_message_of_other_software_is_read(frame: str) -> None:
    """With another frame and a covariance: only the field and the stamp are read."""
    names = names_of(1, 2)
    state, back = state_of(names, 3), RobotState.allocate(1)
    message = ros_type(topics.MAGNETOMETER.type)()
    message.header.frame_id = frame
    message.header.stamp.nanosec = 7 * TIMEBASE.period_ns
    field = message.magnetic_field
    field.x, field.y, field.z = state.magnetic_field.tolist()
    message.magnetic_field_covariance = np.arange(9.0)
    data = bytes(serialization().serialize_message(message))
    reader = StateCodec(names, TIMEBASE)
    for _ in range(2):  # the second one in the layout that the first one taught
        assert reader.decode(topics.MAGNETOMETER, data, back) == 7
        np.testing.assert_array_equal(back.magnetic_field, state.magnetic_field)
        back.magnetic_field[:] = 0.0


def test_a_message_that_is_cut_anywhere_is_refused() -> None:
    names = names_of(1, 1)
    data, codec = sent(names, state_of(names)), StateCodec(names, TIMEBASE)
    for length in range(len(data)):
        with pytest.raises(MessageError, match="not a sensor_msgs/msg/MagneticField"):
            codec.decode(topics.MAGNETOMETER, data[:length], RobotState.allocate(1))


def test_the_controller_needs_it() -> None:
    """It is the last of the parts that it waits for."""
    codec = StateCodec(names_of(3, 3)._replace(wheels=("wheel_1",)), TIMEBASE)
    assert codec.control_topics == (
        topics.JOINT_STATES,
        topics.WHEELS_STATE,
        topics.BASE_STATE,
        topics.MAGNETOMETER,
    )
    assert topics.MAGNETOMETER in topics.STATES
    assert topics.MAGNETOMETER in topics.RECORDED
    assert topics.MAGNETOMETER.per_tick
    assert topics.MAGNETOMETER.is_optional


def test_it_is_one_of_the_topics_that_tell_of_a_flight() -> None:
    """A replay reads no others from a bag, and all others can be remapped by name."""
    assert topics.MAGNETOMETER in topics.ALL
    assert topics.BY_NAME["/magnetometer"] is topics.MAGNETOMETER


def test_a_command_asks_every_torquer_by_name() -> None:
    names = RobotNames.of(
        ("a", "b"), ("wheel_1", "thruster_1", "torquer_1", "torquer_2"), 1, torquer_count=2
    )
    torque = np.arange(1.0, 10.0)
    data = CommandCodec(names.commanded, TIMEBASE).encode(Command(3, torque))
    read = STORE.deserialize_cdr(data, topics.COMMAND.type)
    assert read.name == [
        *("base_x", "base_y", "base_z", "a", "b"),
        *("wheel_1", "thruster_1", "torquer_1", "torquer_2"),
    ]
    np.testing.assert_array_equal(read.effort, torque)
    back = Command(-1, np.zeros(9))
    CommandCodec(names.commanded, TIMEBASE).decode(data, back)
    np.testing.assert_array_equal(back.torque, torque)


@pytest.mark.parametrize(("wheels", "thrusters", "torquers"), [(4, 0, 3), (0, 0, 0), (2, 3, 1)])
def test_actuators_are_told_apart_by_their_number(
    wheels: int, thrusters: int, torquers: int
) -> None:
    counts = {"wheel": wheels, "thruster": thrusters, "torquer": torquers}
    actuators = [f"{kind}_{k + 1}" for kind, count in counts.items() for k in range(count)]
    names = RobotNames.of(("j",), actuators, wheels, ("p",), ("j",), torquers)
    assert [len(part) for part in (names.wheels, names.thrusters, names.torquers)] == [
        *counts.values()
    ]
    assert names.actuators == tuple(actuators)
    assert names.commanded == ("base_x", "base_y", "base_z", "j", *actuators)
    assert (names.passive, names.geared) == (("p",), ("j",))
