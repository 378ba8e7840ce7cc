"""The desired motion as trajectory messages: any lengths, as others read them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_samples import TIMEBASE, joint_names
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
