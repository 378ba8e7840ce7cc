"""/motors/state: the motors of joints with gears, by the names of these joints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_samples import TIMEBASE, joint_names
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import STATE_FIELDS, RobotNames, RobotState
from space_robot_msgs_py.wire.codecs import StateCodec

STORE = get_typestore(Stores.ROS2_JAZZY)


def names_of(joints: int, geared: int) -> RobotNames:
    """Return names of a robot whose last joints have gears."""
    names = tuple(joint_names(joints))
    return RobotNames(names, geared=names[joints - geared :])


def state_of(names: RobotNames, seed: int, tick: int = 7) -> RobotState:
    """Return a state with another number everywhere, zero where there is no motor."""
    rng, state = np.random.default_rng(seed), RobotState.allocate(len(names.joints))
    state.tick, count = tick, len(names.geared)
    for name in STATE_FIELDS:
        getattr(state, name)[:] = rng.normal(size=getattr(state, name).shape)
    state.motor_positions[:count], state.motor_velocities[:count] = rng.normal(size=(2, count))
    return state


@given(st.integers(1, 7), st.integers(0, 7), st.integers(0, 2**32 - 1), st.integers(0, 4 * 10**9))
def test_a_state_comes_back_whole_however_many_gears_it_has(
    joints: int, geared: int, seed: int, tick: int
) -> None:
    names = names_of(joints, min(joints, geared))
    state, back = state_of(names, seed, tick), RobotState.allocate(joints)
    writer, reader = StateCodec(names, TIMEBASE), StateCodec(names, TIMEBASE)
    assert (topics.MOTORS_STATE in writer.topics) == bool(names.geared)
    for topic, data in zip(writer.topics, writer.encode(state), strict=True):
        assert reader.decode(topic, data, back) == tick
    np.testing.assert_array_equal(back.numbers, state.numbers)


def test_other_software_reads_angles_and_rates_by_joint() -> None:
    names = RobotNames(("shoulder", "elbow", "wrist"), geared=("shoulder", "wrist"))
    state = state_of(names, 1)
    codec = StateCodec(names, TIMEBASE)
    sent = dict(zip(codec.topics, codec.encode(state), strict=True))
    message = STORE.deserialize_cdr(sent[topics.MOTORS_STATE], topics.MOTORS_STATE.type)
    assert message.name == ["shoulder", "wrist"]
    assert message.header.frame_id == ""
    stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    assert TIMEBASE.tick(stamp) == 7
    np.testing.assert_array_equal(message.position, state.motor_positions[:2])
    np.testing.assert_array_equal(message.velocity, state.motor_velocities[:2])
    assert not len(message.effort)


def test_motors_are_taken_by_name_and_none_may_lack() -> None:
    joints = ("a", "b", "c")
    theirs, ours, fewer = (
        StateCodec(RobotNames(joints, geared=geared), TIMEBASE)
        for geared in (("c", "a", "b"), joints, joints[:2])
    )
    sent = state_of(RobotNames(joints, geared=joints), 2)
    data = theirs.encode(sent)[theirs.topics.index(topics.MOTORS_STATE)]
    back = RobotState.allocate(3)
    assert ours.decode(topics.MOTORS_STATE, data, back) == 7
    np.testing.assert_array_equal(back.motor_positions, sent.motor_positions[[1, 2, 0]])
    np.testing.assert_array_equal(back.motor_velocities, sent.motor_velocities[[1, 2, 0]])
    with pytest.raises(MessageError, match="/motors/state: names"):
        fewer.decode(topics.MOTORS_STATE, data, RobotState.allocate(3))


def test_the_controller_does_without_it() -> None:
    """It has the measured joints, of which some may be measured at their motors."""
    codec = StateCodec(names_of(3, 2), TIMEBASE)
    assert set(codec.topics) - set(codec.control_topics) == {topics.MOTORS_STATE}
