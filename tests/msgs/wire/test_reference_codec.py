"""The desired motion as trajectory messages: any lengths, as others read them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_samples import TIMEBASE, joint_names, ros_type, serialization
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import ReferenceChunk, Timebase
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec

STORE = get_typestore(Stores.ROS2_JAZZY)
JOINTS, BASE = topics.REFERENCE_JOINTS.type, topics.REFERENCE_BASE.type


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


@pytest.mark.parametrize("reader", ["rclpy", "rosbags"])
@pytest.mark.parametrize(("n", "length"), [(1, 1), (2, 2), (6, 50)])
def test_chunk_is_read_as_trajectories(n: int, length: int, reader: str) -> None:
    """Points one tick apart; quaternions x, y, z, w; angular parts only."""
    chunk = random_chunk(n, length)
    data = ReferenceCodec(joint_names(n), TIMEBASE).encode(chunk)
    joints, base = (
        serialization().deserialize_message(part, ros_type(kind))
        if reader == "rclpy"
        else STORE.deserialize_cdr(part, kind)
        for part, kind in zip(data, (JOINTS, BASE), strict=True)
    )
    assert list(joints.joint_names) == joint_names(n)
    assert list(base.joint_names) == [topics.BASE_JOINT]
    assert base.header.frame_id == topics.INERTIAL_FRAME
    for message in (joints, base):
        assert (message.header.stamp.sec, message.header.stamp.nanosec) == (0, 50_000_000)
        after = [(p.time_from_start.sec, p.time_from_start.nanosec) for p in message.points]
        assert after == [(0, 500_000 * k) for k in range(length)]
    for point, row in zip(joints.points, chunk.joints, strict=True):
        np.testing.assert_array_equal(point.positions, row[0])
        np.testing.assert_array_equal(point.velocities, row[1])
        np.testing.assert_array_equal(point.accelerations, row[2])
        assert len(point.effort) == 0
    for point, row in zip(base.points, chunk.base, strict=True):
        (transform,), (velocity,) = point.transforms, point.velocities
        (acceleration,), q = point.accelerations, transform.rotation
        assert [q.w, q.x, q.y, q.z] == row[:4].tolist()
        for vector, expected in (
            (velocity.angular, row[4:7]),
            (acceleration.angular, row[7:]),
            (velocity.linear, [0.0] * 3),
            (transform.translation, [0.0] * 3),
        ):
            assert [vector.x, vector.y, vector.z] == list(expected)


def test_points_more_than_a_second_apart_carry_into_the_seconds() -> None:
    data = ReferenceCodec(joint_names(2), Timebase(600_000_000)).encode(random_chunk(2, 4))
    after = [p.time_from_start for p in STORE.deserialize_cdr(data[0], JOINTS).points]
    assert [t.sec * 10**9 + t.nanosec for t in after] == [600_000_000 * k for k in range(4)]
    assert [t.sec for t in after] == [0, 0, 1, 1]


def test_after_a_chunk_of_another_period_the_own_times_are_written() -> None:
    chunk, other = random_chunk(2, 3), ReferenceCodec(joint_names(2), Timebase(1_000_000))
    codec = ReferenceCodec(joint_names(2), TIMEBASE)
    good = codec.encode(chunk)
    for decode, data in zip(
        (codec.decode_joints, codec.decode_base), other.encode(chunk), strict=True
    ):
        with pytest.raises(MessageError, match="point 1 is not 1 ticks after") as error:
            decode(data)
        assert error.value.reason
    assert codec.encode(chunk) == good
