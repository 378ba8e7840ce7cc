"""Joints without motors in /joint_states and /truth/joints: behind the others, without effort."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_samples import TIMEBASE, joint_names
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import (
    MOST_PASSIVE,
    PASSIVE_FIELDS,
    STATE_FIELDS,
    RobotNames,
    RobotState,
)
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_msgs_py.wire.truth_writer import TruthWriter

STORE = get_typestore(Stores.ROS2_JAZZY)


def names_of(joints: int, passive: int) -> RobotNames:
    panels = tuple(f"panel{'_' * (k % 3)}{k}" for k in range(passive))
    return RobotNames(tuple(joint_names(joints)), passive=panels)


def state_of(names: RobotNames, seed: int, tick: int = 7) -> RobotState:
    """A state with another number everywhere, zero where there is no joint."""
    rng, state = np.random.default_rng(seed), RobotState.allocate(len(names.joints))
    state.tick = tick
    for name in STATE_FIELDS:
        getattr(state, name)[:] = rng.normal(size=getattr(state, name).shape)
    for name in PASSIVE_FIELDS:
        getattr(state, name)[: len(names.passive)] = rng.normal(size=len(names.passive))
    return state


@given(st.integers(1, 7), st.integers(0, MOST_PASSIVE), st.integers(0, 2**32 - 1))
def test_a_state_comes_back_whole_whatever_hangs_on_the_robot(n: int, p: int, seed: int) -> None:
    names = names_of(n, p)
    state, back = state_of(names, seed), RobotState.allocate(n)
    writer, reader = StateCodec(names, TIMEBASE), StateCodec(names, TIMEBASE)
    for topic, data in zip(writer.topics, writer.encode(state), strict=True):
        assert reader.decode(topic, data, back) == state.tick
    np.testing.assert_array_equal(back.numbers, state.numbers)


def test_other_software_reads_all_joints_by_name() -> None:
    names = names_of(2, 3)
    state = state_of(names, 1)
    codec = StateCodec(names, TIMEBASE)
    sent = dict(zip(codec.topics, codec.encode(state), strict=True))
    read = STORE.deserialize_cdr(sent[topics.JOINT_STATES], topics.JOINT_STATES.type)
    assert read.name == [*names.joints, *names.passive]
    for field in ("position", "velocity"):
        told = [
            *getattr(state, f"joint_{field[:-1]}ies" if field == "velocity" else "joint_positions")
        ]
        ours = "passive_positions" if field == "position" else "passive_velocities"
        np.testing.assert_array_equal(getattr(read, field), [*told, *getattr(state, ours)[:3]])
    np.testing.assert_array_equal(read.effort, [*state.applied_torque[3:], 0.0, 0.0, 0.0])


def test_a_robot_without_them_sends_the_bytes_it_always_sent() -> None:
    """Laid out by ROS's rules from the message alone."""
    names = names_of(3, 0)
    state = state_of(names, 2)
    codec = StateCodec(names, TIMEBASE)
    data = codec.encode(state)[codec.topics.index(topics.JOINT_STATES)]
    message = STORE.deserialize_cdr(data, topics.JOINT_STATES.type)
    assert message.name == list(names.joints)
    assert bytes(STORE.serialize_cdr(message, topics.JOINT_STATES.type)) == data


def test_they_are_taken_by_name_and_none_may_lack() -> None:
    """A joint_state_publisher may put its names in any order."""
    ours = names_of(2, 2)
    state = state_of(ours, 3)
    theirs = RobotNames((ours.passive[1], ours.joints[1], ours.passive[0], ours.joints[0]))
    sent = RobotState.allocate(4)
    sent.joint_positions[:] = *state.passive_positions[1::-1], *state.joint_positions[::-1]
    sent.joint_positions[:] = sent.joint_positions[[0, 2, 1, 3]]
    writer, reader = StateCodec(theirs, TIMEBASE), StateCodec(ours, TIMEBASE)
    data = writer.encode(sent)[writer.topics.index(topics.JOINT_STATES)]
    back = RobotState.allocate(2)
    reader.decode(topics.JOINT_STATES, data, back)
    np.testing.assert_array_equal(back.joint_positions, state.joint_positions)
    np.testing.assert_array_equal(back.passive_positions, state.passive_positions)
    for other in (names_of(2, 1), names_of(2, 0)):
        with pytest.raises(MessageError, match="/joint_states: names"):
            StateCodec(other, TIMEBASE).decode(topics.JOINT_STATES, data, back)


def test_the_truth_tells_them_too() -> None:
    names = names_of(2, 3)
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
