"""The desired motion as trajectory messages, read and written by others as well."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from random_samples import TIMEBASE, joint_names
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import ReferenceChunk, Timebase
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec

Array = NDArray[np.float64]

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


@settings(max_examples=60)
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
@pytest.mark.parametrize(("n", "length"), [(1, 1), (2, 2), (6, 50), (7, 3)])
def test_chunk_is_read_as_trajectories(n: int, length: int, reader: str) -> None:
    """Points one tick apart; quaternions x, y, z, w; angular parts only."""
    chunk = random_chunk(n, length)
    data = ReferenceCodec(joint_names(n), TIMEBASE).encode(chunk)
    if reader == "rclpy":
        serialization = pytest.importorskip("rclpy.serialization")
        types = pytest.importorskip("trajectory_msgs.msg")
        joints = serialization.deserialize_message(data[0], types.JointTrajectory)
        base = serialization.deserialize_message(data[1], types.MultiDOFJointTrajectory)
    else:
        joints, base = (
            STORE.deserialize_cdr(d, t) for d, t in zip(data, (JOINTS, BASE), strict=True)
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
    chunk = random_chunk(2, 4)
    data = ReferenceCodec(joint_names(2), Timebase(600_000_000)).encode(chunk)
    after = [p.time_from_start for p in STORE.deserialize_cdr(data[0], JOINTS).points]
    assert [(t.sec, t.nanosec) for t in after] == [
        (0, 0),
        (0, 600_000_000),
        (1, 200_000_000),
        (1, 800_000_000),
    ]


# Written by others


class Foreign:
    """Trajectories as rosbags writes them (without rclpy's trailing bytes)."""

    types: Any = STORE.types

    @classmethod
    def header(cls, frame: str = "elsewhere") -> Any:
        """At 50 ms, tick 100."""
        time = cls.types["builtin_interfaces/msg/Time"](0, 50_000_000)
        return cls.types["std_msgs/msg/Header"](time, frame)

    @classmethod
    def after(cls, ns: int) -> Any:
        return cls.types["builtin_interfaces/msg/Duration"](*divmod(ns, 10**9))

    @classmethod
    def joints(cls, names: list[str], rows: Any) -> bytes:
        """Efforts filled as well, which nobody asked for."""
        points = [
            cls.types["trajectory_msgs/msg/JointTrajectoryPoint"](
                *map(np.ascontiguousarray, row), np.ones(len(names)), cls.after(k * 500_000)
            )
            for k, row in enumerate(rows)
        ]
        message = cls.types["trajectory_msgs/msg/JointTrajectory"](cls.header(), names, points)
        return bytes(STORE.serialize_cdr(message, JOINTS))

    @classmethod
    def base(cls, rows: Array, accelerations: bool = True) -> bytes:
        vector, quaternion, twist, transform = (
            cls.types[f"geometry_msgs/msg/{name}"]
            for name in ("Vector3", "Quaternion", "Twist", "Transform")
        )
        ones = vector(1.0, 1.0, 1.0)
        points = [
            cls.types["trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"](
                [transform(ones, quaternion(*row[1:4], row[0]))],
                [twist(ones, vector(*row[4:7]))],
                [twist(ones, vector(*row[7:]))] if accelerations else [],
                cls.after(k * 500_000),
            )
            for k, row in enumerate(rows)
        ]
        message = cls.types["trajectory_msgs/msg/MultiDOFJointTrajectory"](
            cls.header(), ["base"], points
        )
        return bytes(STORE.serialize_cdr(message, BASE))


def test_foreign_trajectories_are_read_by_name_and_with_fields_not_used() -> None:
    """Joints in another order, another frame, efforts, linear parts; twice each."""
    names, order = joint_names(4), [2, 0, 3, 1]
    codec = ReferenceCodec(names, TIMEBASE)
    for seed in (1, 2):
        chunk = random_chunk(4, 5, seed)
        joints = Foreign.joints([names[i] for i in order], chunk.joints[:, :, order])
        assert_decodes_to(codec, (joints, Foreign.base(chunk.base)), chunk)
    own = random_chunk(4, 5, 3)
    assert_decodes_to(codec, ReferenceCodec(names, TIMEBASE).encode(own), own)


def test_trajectory_serialized_by_rclpy_is_read() -> None:
    """Empty efforts make its size estimate too large by 8 bytes a point."""
    serialization = pytest.importorskip("rclpy.serialization")
    types = pytest.importorskip("trajectory_msgs.msg")
    chunk, message = random_chunk(3, 10), types.JointTrajectory(joint_names=joint_names(3))
    message.header.frame_id, message.header.stamp.nanosec = "elsewhere", 50_000_000
    for k, (position, velocity, acceleration) in enumerate(chunk.joints.tolist()):
        point = types.JointTrajectoryPoint(
            positions=position, velocities=velocity, accelerations=acceleration
        )
        point.time_from_start.nanosec = 500_000 * k
        message.points.append(point)
    data = bytes(serialization.serialize_message(message))
    start, joints = ReferenceCodec(joint_names(3), TIMEBASE).decode_joints(data)
    assert start == 100
    np.testing.assert_array_equal(joints, chunk.joints)


# What does not fit


def test_other_joints_are_an_error_that_names_both() -> None:
    chunk = random_chunk(2, 3)
    with pytest.raises(MessageError, match=r"/reference/joints.*\['a', 'c'\].*\['a', 'b'\]"):
        ReferenceCodec(["a", "b"], TIMEBASE).decode_joints(Foreign.joints(["a", "c"], chunk.joints))


@pytest.mark.parametrize("codec_saw_the_layout", [False, True])
def test_points_not_one_tick_apart_are_an_error(codec_saw_the_layout: bool) -> None:
    """On the fast way too, and the next message is read again."""
    names, chunk = joint_names(2), random_chunk(2, 3)
    codec, good = ReferenceCodec(names, TIMEBASE), ReferenceCodec(names, TIMEBASE).encode(chunk)
    if codec_saw_the_layout:
        assert_decodes_to(codec, good, chunk)
    joints, base = ReferenceCodec(names, Timebase(1_000_000)).encode(chunk)
    with pytest.raises(MessageError, match="/reference/joints: point 1 is not 1 ticks after"):
        codec.decode_joints(joints)
    with pytest.raises(MessageError, match="/reference/base: point 1 is not 1 ticks after"):
        codec.decode_base(base)
    assert codec.encode(chunk) == good, "with its own times again"
    assert_decodes_to(codec, good, chunk)


def test_a_start_between_ticks_is_an_error() -> None:
    data = ReferenceCodec(["a"], TIMEBASE).encode(random_chunk(1, 1, start=1))
    codec = ReferenceCodec(["a"], Timebase(1_000_000))
    for decode, message in zip((codec.decode_joints, codec.decode_base), data, strict=True):
        with pytest.raises(MessageError, match="500000 ns is not a whole number"):
            decode(message)


@pytest.mark.parametrize("fault", ["no points", "ragged", "no base points", "no accelerations"])
def test_incomplete_trajectories_are_message_errors(fault: str) -> None:
    """As for a JointState that lacks an array."""
    names, chunk = ["a", "b"], random_chunk(2, 3)
    codec, ragged = ReferenceCodec(names, TIMEBASE), [[np.ones(2), np.ones(0), np.ones(2)]]
    decode, data = {
        "no points": (codec.decode_joints, Foreign.joints(names, chunk.joints[:0])),
        "ragged": (codec.decode_joints, Foreign.joints(names, ragged)),
        "no base points": (codec.decode_base, Foreign.base(chunk.base[:0])),
        "no accelerations": (codec.decode_base, Foreign.base(chunk.base, accelerations=False)),
    }[fault]
    with pytest.raises(MessageError):
        decode(data)


@pytest.mark.parametrize("short", range(3))
@pytest.mark.parametrize("point", [0, 2])
def test_points_of_unequal_length_are_a_message_error(short: int, point: int) -> None:
    """The shorter array is named, and the next good message is read."""
    names, chunk = joint_names(4), random_chunk(4, 3)
    codec, rows = ReferenceCodec(names, TIMEBASE), [list(row) for row in chunk.joints]
    rows[point][short] = rows[point][short][:-1]
    field = ("positions", "velocities", "accelerations")[short]
    with pytest.raises(MessageError, match=f"a point lacks {field} of some joint") as error:
        codec.decode_joints(Foreign.joints(names, rows))
    assert error.value.reason == "size"
    assert_decodes_to(codec, codec.encode(chunk), chunk)
