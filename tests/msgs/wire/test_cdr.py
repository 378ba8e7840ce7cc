"""Fixed-layout messages: alignment, slots, views, and which bytes they take."""

from __future__ import annotations

import contextlib
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.message_accounting import message_tick
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.cdr import CdrBuilder, FixedMessage, Slot, header_stamp_ns

ENCAPSULATION = b"\x00\x01\x00\x00"
STORE = get_typestore(Stores.ROS2_JAZZY)

names = st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\0")), max_size=6)
stamps = st.integers(-(2**31) * 10**9, (2**31 - 1) * 10**9)


def joint_state(frame: str, joints: list[str], count: int) -> tuple[FixedMessage, Slot, list[Slot]]:
    """A JointState laid out by hand: stamp, then position, velocity, effort."""
    builder = CdrBuilder()
    stamp = builder.header_slot(frame)
    builder.strings(joints)
    slots = [builder.float64_sequence_slot(k) for k in (count, 0, count)]
    return builder.build(), stamp, slots


def test_layout_is_plain_cdr_little_endian() -> None:
    """Byte for byte by hand: alignment counts from behind the encapsulation header."""
    message, stamp, slots = joint_state("abcd", ["x"], 1)
    message.set_stamp(stamp, 3_000_000_004)
    message.float64(slots[0])[:], message.float64(slots[2])[:] = 1.5, -2.5
    assert message.to_bytes() == ENCAPSULATION + b"".join(
        [
            struct.pack("<iI", 3, 4),
            struct.pack("<I", 5), b"abcd\0", b"\0" * 3,
            struct.pack("<I", 1), struct.pack("<I", 2), b"x\0", b"\0\0",
            struct.pack("<I", 1), b"\0" * 4, struct.pack("<d", 1.5),
            struct.pack("<I", 0),
            struct.pack("<I", 1), struct.pack("<d", -2.5),
        ]
    )  # fmt: skip


@given(st.text(st.characters(codec="utf-8", exclude_characters="\0")), names, stamps)
def test_any_names_are_laid_out_as_rosbags_does(
    frame: str, joints: list[str], stamp_ns: int
) -> None:
    """The other writer's bytes and ours agree, for strings of any length and script."""
    message, stamp, slots = joint_state(frame, joints, len(joints))
    values = np.arange(len(joints)) + 0.25
    message.float64(slots[0])[:], message.float64(slots[2])[:] = values, -values
    message.set_stamp(stamp, stamp_ns)
    types = STORE.types
    time = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
    header = types["std_msgs/msg/Header"](time, frame)
    theirs = types["sensor_msgs/msg/JointState"](header, joints, values, np.zeros(0), -values)
    expected = STORE.serialize_cdr(theirs, "sensor_msgs/msg/JointState")
    assert message.to_bytes() == bytes(expected)


@given(stamps)
def test_stamp_round_trip(stamp_ns: int) -> None:
    """Seconds negative, nanoseconds never: as builtin_interfaces/Time wants it."""
    message, stamp, _ = joint_state("", [], 0)
    message.set_stamp(stamp, stamp_ns)
    assert message.stamp_ns(stamp) == stamp_ns
    assert header_stamp_ns(message.to_bytes()) == stamp_ns
    sec, nanosec = struct.unpack_from("<iI", message.to_bytes(), 4)
    assert 0 <= nanosec < 10**9
    assert sec * 10**9 + nanosec == stamp_ns


def test_views_are_aligned_in_memory_and_write_through() -> None:
    for length in range(9):
        message, _, slots = joint_state("f" * length, ["joint"], 3)
        view = message.float64(slots[0])
        assert view.flags.aligned
        assert view.ctypes.data % 8 == 0
        view[:] = [1.0, 2.0, 3.0]
        np.testing.assert_array_equal(message.float64(slots[0]), [1.0, 2.0, 3.0])


def test_load_takes_the_numbers_of_the_same_layout() -> None:
    """Trailing bytes do not matter."""
    source, stamp, slots = joint_state("abc", ["left", "r"], 2)
    target, _, _ = joint_state("abc", ["left", "r"], 2)
    source.set_stamp(stamp, 123)
    source.float64(slots[0])[:] = [1.0, 2.0]
    for tail in (b"", b"\x7f", b"\xff" * 40):
        target.float64(slots[0])[:] = 0.0
        assert target.load(source.to_bytes() + tail)
        np.testing.assert_array_equal(target.float64(slots[0]), [1.0, 2.0])
        assert target.stamp_ns(stamp) == 123


def test_padding_is_ignored_when_a_foreign_writer_fills_it() -> None:
    """After "ab" and its NUL stands one byte of padding."""
    message, _, _ = joint_state("ab", ["x"], 1)
    data = bytearray(message.to_bytes())
    place = data.index(b"ab\0") + 3
    data[place] = 0xAA
    assert message.load(bytes(data))


@pytest.mark.parametrize(
    "other",
    [("abd", ["left", "r"], 2), ("abc", ["left", "s"], 2), ("abc", ["left", "r"], 1), ("", [], 0)],
)
def test_load_refuses_another_layout_and_takes_nothing(
    other: tuple[str, list[str], int],
) -> None:
    message, stamp, slots = joint_state("abc", ["left", "r"], 2)
    message.set_stamp(stamp, 77)
    message.float64(slots[2])[:] = [5.0, 6.0]
    before = message.to_bytes()
    foreign, _, foreign_slots = joint_state(*other)
    foreign.float64(foreign_slots[0])[:] = 9.0
    assert not message.load(foreign.to_bytes())
    assert message.to_bytes() == before


def test_load_refuses_what_is_cut_short_or_big_endian() -> None:
    message, _, _ = joint_state("abc", ["left"], 1)
    data = message.to_bytes()
    assert not message.load(data[:-1])
    assert not message.load(b"")
    assert not message.load(b"\x00\x00" + data[2:])


@given(st.integers(1, 20), st.integers(1, 9))
def test_rows_are_one_view_on_equally_spaced_slots(rows: int, count: int) -> None:
    """As a trajectory's points are: each row a sequence, then a stamp."""
    builder = CdrBuilder()
    builder.uint32(rows)
    slots, times = [], []
    for _ in range(rows):
        slots.append(builder.float64_sequence_slot(count))
        times.append(builder.stamp_slot())
    message = builder.build()
    table = np.arange(rows * count, dtype=float).reshape(rows, count)
    message.float64_rows(slots)[:] = table
    message.stamp_rows(times)[:, 1] = np.arange(rows)
    for i in range(rows):
        np.testing.assert_array_equal(message.float64(slots[i]), table[i])
        assert message.stamp_ns(times[i]) == i


def test_rows_of_unequal_spacing_are_refused() -> None:
    message = FixedMessage(bytes(64), [], [])
    with pytest.raises(ValueError, match="equally spaced"):
        message.float64_rows([Slot(0, 1), Slot(8, 1), Slot(24, 1)])
    with pytest.raises(ValueError, match="equally spaced"):
        message.float64_rows([Slot(0, 1), Slot(8, 2)])


@given(st.sampled_from(topics.ALL), st.binary(max_size=200))
def test_garbage_has_a_tick_or_is_refused(topic: topics.Topic, garbage: bytes) -> None:
    """Whatever a stranger sends: the recorder asks every message for its tick."""
    for data in (garbage, ENCAPSULATION + garbage):
        with contextlib.suppress(MessageError):
            assert message_tick(topic, data, Timebase(500_000)) >= 0
