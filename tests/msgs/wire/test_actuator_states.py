"""/wheels/state and /thrusters/state, and commands to wheels and thrusters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_samples import TIMEBASE, assert_same, joint_names
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import (
    ACTUATOR_FIELDS,
    MOST_THRUSTERS,
    MOST_WHEELS,
    STATE_FIELDS,
    Command,
    RobotNames,
    RobotState,
)
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec

STORE = get_typestore(Stores.ROS2_JAZZY)


def names_of(joints: int, wheels: int, thrusters: int) -> RobotNames:
    return RobotNames(
        tuple(joint_names(joints)),
        tuple(f"wheel_{k + 1}" for k in range(wheels)),
        tuple(f"thruster_{k + 1}" for k in range(thrusters)),
    )


def state_of(names: RobotNames, seed: int, tick: int) -> RobotState:
    """A state with another number everywhere, zero where there is no wheel and no thruster."""
    rng, state = np.random.default_rng(seed), RobotState.allocate(len(names.joints))
    state.tick = tick
    for name in STATE_FIELDS:
        getattr(state, name)[:] = rng.normal(size=getattr(state, name).shape)
    geared = len(names.geared)
    counts = (len(names.wheels), len(names.wheels), len(names.thrusters), geared, geared)
    for name, count in zip(ACTUATOR_FIELDS, counts, strict=True):
        getattr(state, name)[:count] = rng.normal(size=count)
    return state


@given(
    st.integers(1, 7),
    st.integers(0, MOST_WHEELS),
    st.integers(0, MOST_THRUSTERS),
    st.integers(0, 2**32 - 1),
    st.integers(0, 4 * 10**9),
)
def test_a_state_comes_back_whole_whatever_actuators_it_has(
    joints: int, wheels: int, thrusters: int, seed: int, tick: int
) -> None:
    names = names_of(joints, wheels, thrusters)
    state, back = state_of(names, seed, tick), RobotState.allocate(joints)
    writer, reader = StateCodec(names, TIMEBASE), StateCodec(names, TIMEBASE)
    assert set(writer.topics) == {
        topics.JOINT_STATES,
        topics.BASE_STATE,
        *([topics.WHEELS_STATE] if wheels else []),
        *([topics.THRUSTERS_STATE] if thrusters else []),
    }
    for topic, data in zip(writer.topics, writer.encode(state), strict=True):
        assert reader.decode(topic, data, back) == tick
    assert_same(back, state)
    for name in ACTUATOR_FIELDS:
        np.testing.assert_array_equal(getattr(back, name), getattr(state, name), name)


def test_other_software_reads_speeds_torques_and_thrusts_by_name() -> None:
    names = names_of(2, 3, 4)
    state = state_of(names, 1, 7)
    codec = StateCodec(names, TIMEBASE)
    sent = dict(zip(codec.topics, codec.encode(state), strict=True))
    wheels = STORE.deserialize_cdr(sent[topics.WHEELS_STATE], topics.WHEELS_STATE.type)
    assert wheels.name == ["wheel_1", "wheel_2", "wheel_3"]
    assert wheels.header.frame_id == topics.BASE_FRAME
    assert not len(wheels.position)
    np.testing.assert_array_equal(wheels.velocity, state.wheel_velocities[:3])
    np.testing.assert_array_equal(wheels.effort, state.wheel_torques[:3])
    thrusters = STORE.deserialize_cdr(sent[topics.THRUSTERS_STATE], topics.THRUSTERS_STATE.type)
    assert thrusters.name == ["thruster_1", "thruster_2", "thruster_3", "thruster_4"]
    assert not len(thrusters.position)
    assert not len(thrusters.velocity)
    np.testing.assert_array_equal(thrusters.effort, state.thrusts[:4])


def test_wheels_are_taken_by_name_and_none_may_lack() -> None:
    theirs, ours = ("wheel_3", "wheel_1", "wheel_2"), ("wheel_1", "wheel_2", "wheel_3")
    sent, back = state_of(names_of(1, 3, 0), 2, 5), RobotState.allocate(1)
    writer, reader, lacks = (
        StateCodec(RobotNames(("j",), wheels), TIMEBASE) for wheels in (theirs, ours, ours[:2])
    )
    data = writer.encode(sent)[writer.topics.index(topics.WHEELS_STATE)]
    assert reader.decode(topics.WHEELS_STATE, data, back) == 5
    np.testing.assert_array_equal(back.wheel_velocities[:3], sent.wheel_velocities[[1, 2, 0]])
    np.testing.assert_array_equal(back.wheel_torques[:3], sent.wheel_torques[[1, 2, 0]])
    with pytest.raises(MessageError, match="/wheels/state: names"):
        lacks.decode(topics.WHEELS_STATE, data, back)


def test_only_the_controller_does_without_the_thrusters_state() -> None:
    codec = StateCodec(names_of(2, 1, 1), TIMEBASE)
    assert set(codec.topics) - set(codec.control_topics) == {topics.THRUSTERS_STATE}


def test_a_command_asks_every_wheel_and_thruster_by_name() -> None:
    names = names_of(2, 2, 1)
    torque = np.arange(1.0, 9.0)
    data = CommandCodec(names.commanded, TIMEBASE).encode(Command(3, torque))
    read = STORE.deserialize_cdr(data, topics.COMMAND.type)
    assert read.name == [
        "base_x",
        "base_y",
        "base_z",
        *names.joints,
        "wheel_1",
        "wheel_2",
        "thruster_1",
    ]
    np.testing.assert_array_equal(read.effort, torque)
    back = Command(-1, np.zeros(8))
    CommandCodec(names.commanded, TIMEBASE).decode(data, back)
    np.testing.assert_array_equal(back.torque, torque)
    with pytest.raises(MessageError, match="/command: names"):
        CommandCodec(names.axes, TIMEBASE).decode(data, Command(-1, np.zeros(5)))
