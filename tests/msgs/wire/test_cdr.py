"""Messages laid out from their definitions: alignment, slots, and which bytes fit a layout."""

from __future__ import annotations

import contextlib
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.message_accounting import message_tick
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.cdr import MessageLayout, Slot, header_stamp_ns
from space_robot_msgs_py.wire.codec import Codec
from space_robot_msgs_py.wire.compiled_codec import FOREIGN, CompiledCodec
from space_robot_msgs_py.wire.joint_states import JointStates

ENCAPSULATION = b"\x00\x01\x00\x00"
STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = sorted({topic.type for topic in (*topics.ALL, topics.DIAGNOSTICS)})
OTHERS = ["sensor_msgs/msg/Imu", "sensor_msgs/msg/NavSatFix", "sensor_msgs/msg/CameraInfo"]
"""Arrays of a fixed length, other integers, float64 behind them."""

texts = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9)
names = st.lists(texts, max_size=6, unique=True)
seeds = st.integers(0, 2**32 - 1)
stamps = st.integers(-(2**31) * 10**9, (2**31 - 1) * 10**9)


def random_message(type_name: str, rng: np.random.Generator) -> Any:
    """Any message of a type."""
    definition = STORE.get_msgdef(type_name)
    return definition.cls(*(random_field(field, rng) for _, field in definition.fields))


def random_field(description: Any, rng: np.random.Generator) -> Any:
    kind, of = description
    if kind is Nodetype.NAME:
        return random_message(of, rng)
    if kind is Nodetype.BASE:
        return random_value(of[0], rng)
    element, count = of
    length = count if kind is Nodetype.ARRAY else rng.integers(4)
    items = [random_field(element, rng) for _ in range(length)]
    is_number = element[0] is Nodetype.BASE and element[1][0] != "string"
    return np.array(items, element[1][0].replace("byte", "uint8")) if is_number else items


def random_value(kind: str, rng: np.random.Generator) -> Any:
    if kind == "string":
        return "".join(rng.choice(list("ab/é语"), rng.integers(9)))
    if kind == "bool":
        return bool(rng.integers(2))
    if kind.startswith("float"):
        return float(rng.choice([rng.normal(), np.nan, np.inf, -0.0, 0.0]))
    return int(rng.integers(128))


def joint_state(frame: str, joints: list[str], count: int) -> MessageLayout:
    """A JointState with so many positions and efforts."""
    content = {
        "header": {"frame_id": frame},
        "name": joints,
        "position": [0.0] * count,
        "effort": [0.0] * count,
    }
    return MessageLayout("sensor_msgs/msg/JointState", content)


def numbers(data: bytes, slot: Slot) -> NDArray[np.float64]:
    return np.frombuffer(data, np.float64, slot.length, slot.offset)


class FramedStates(JointStates):
    """With a frame, so that the numbers stand elsewhere."""

    def __init__(self, frame: str, joints: list[str]) -> None:
        self.frame_id = frame
        super().__init__(joints, Timebase(1))


def test_layout_is_plain_cdr_little_endian() -> None:
    """Byte for byte by hand: alignment counts from behind the encapsulation header."""
    layout = MessageLayout(
        "sensor_msgs/msg/JointState",
        {
            "header": {"stamp": {"sec": 3, "nanosec": 4}, "frame_id": "abcd"},
            "name": ["x"],
            "position": [1.5],
            "effort": [-2.5],
        },
    )
    assert layout.data == ENCAPSULATION + b"".join(
        [
            struct.pack("<iI", 3, 4),
            struct.pack("<I", 5),
            b"abcd\0",
            b"\0" * 3,
            struct.pack("<I", 1),
            struct.pack("<I", 2),
            b"x\0",
            b"\0\0",
            struct.pack("<I", 1),
            b"\0" * 4,
            struct.pack("<d", 1.5),
            struct.pack("<I", 0),
            struct.pack("<I", 1),
            struct.pack("<d", -2.5),
        ]
    )
    stands = [slot for slot in layout.slots.values() if slot.length]
    assert [numbers(layout.data, slot).tolist() for slot in stands] == [[1.5], [-2.5]]


@pytest.mark.parametrize("type_name", [*TYPES, *OTHERS])
@given(seed=seeds)
def test_any_message_is_laid_out_as_rosbags_does(type_name: str, seed: int) -> None:
    """The other writer's bytes and ours agree, whatever stands in it; to the last bit."""
    message = random_message(type_name, np.random.default_rng(seed))
    expected = STORE.serialize_cdr(message, type_name)
    assert MessageLayout(type_name, message).data == bytes(expected)


@pytest.mark.parametrize("type_name", TYPES)
@given(seed=seeds)
def test_slots_and_stamps_are_all_that_changes_with_the_numbers(type_name: str, seed: int) -> None:
    """Two messages that differ in their numbers only have one pattern; the slots find them."""
    layout = MessageLayout(type_name, random_message(type_name, np.random.default_rng(seed)))
    wire, constant = layout.pattern
    spoilt = np.where(constant == 0, ~wire, wire).astype(np.uint8)  # padding, too
    for slot in layout.slots.values():
        assert not constant[slot.offset : slot.offset + 8 * slot.length].any()
        assert not slot.length or (slot.offset - len(ENCAPSULATION)) % 8 == 0
    other = MessageLayout(type_name, STORE.deserialize_cdr(spoilt.tobytes(), type_name))
    assert other.slots == layout.slots
    assert np.array_equal(other.pattern[1], constant)
    assert np.array_equal(other.pattern[0] & constant, wire & constant)
    for slot in layout.slots.values():
        expected = numbers(spoilt.tobytes(), slot)
        assert numbers(other.data, slot).tobytes() == expected.tobytes()


def test_a_field_that_is_not_given_is_zero_or_empty() -> None:
    for type_name in (*TYPES, *OTHERS):
        message = STORE.deserialize_cdr(MessageLayout(type_name, {}).data, type_name)
        assert MessageLayout(type_name, message).data == MessageLayout(type_name, {}).data


def test_a_slot_is_found_by_its_path() -> None:
    content = {"transforms": [{}, {}], "twist": [{"angular": {"x": 1.0, "y": 2.0, "z": 3.0}}]}
    layout = MessageLayout(topics.BASE_STATE.type, content)
    assert numbers(layout.data, layout.slots["twist[0].angular"]).tolist() == [1.0, 2.0, 3.0]
    rotation, translation = (
        layout.slots[f"transforms[1].{name}"] for name in ("rotation", "translation")
    )
    assert (rotation.offset - translation.offset, rotation.length) == (24, 4)


@given(texts, names, stamps)
def test_any_names_are_written_as_rosbags_does(
    frame: str, joints: list[str], stamp_ns: int
) -> None:
    """The other writer's bytes and ours agree, for strings of any length and script."""
    values = np.arange(3 * len(joints)) + 0.25
    types = STORE.types
    time = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
    header = types["std_msgs/msg/Header"](time, frame)
    theirs = types["sensor_msgs/msg/JointState"](header, joints, *values.reshape(3, -1))
    expected = STORE.serialize_cdr(theirs, "sensor_msgs/msg/JointState")
    for codec in (Codec(FramedStates(frame, joints)), CompiledCodec(FramedStates(frame, joints))):
        assert codec.encode(stamp_ns, values) == bytes(expected)


@given(stamps)
def test_stamp_round_trip(stamp_ns: int) -> None:
    """Seconds negative, nanoseconds never: as builtin_interfaces/Time wants it."""
    data = CompiledCodec(FramedStates("", [])).encode(stamp_ns, np.empty(0))
    assert data == Codec(FramedStates("", [])).encode(stamp_ns, np.empty(0))
    assert CompiledCodec(FramedStates("", [])).decode(data, np.empty(0)) == stamp_ns
    assert Codec(FramedStates("", [])).decode(data)[0] == stamp_ns
    assert header_stamp_ns(data) == stamp_ns
    sec, nanosec = struct.unpack_from("<iI", data, 4)
    assert 0 <= nanosec < 10**9
    assert sec * 10**9 + nanosec == stamp_ns


def test_numbers_stand_where_they_should_whatever_stands_before() -> None:
    """Both codecs, for frames of every length."""
    values = np.arange(9) - 4.5
    for length in range(9):
        description = FramedStates("f" * length, ["joint", "x", "yy"])
        data = Codec(description).encode(7, values)
        assert data == CompiledCodec(description).encode(7, values)
        message = STORE.deserialize_cdr(data, "sensor_msgs/msg/JointState")
        arrays = [message.position, message.velocity, message.effort]
        np.testing.assert_array_equal(np.concatenate(arrays), values)
        stamp_ns, back = Codec(description).decode(data)
        assert stamp_ns == 7
        np.testing.assert_array_equal(back, values)


def test_the_numbers_of_the_same_layout_are_taken() -> None:
    """Trailing bytes do not matter."""
    description, sent = FramedStates("abc", ["left", "r"]), np.arange(6) + 0.5
    data, codec = CompiledCodec(description).encode(123, sent), CompiledCodec(description)
    for tail in (b"", b"\x7f", b"\xff" * 40):
        values = np.zeros(6)
        assert codec.read(data + tail, values) == 123
        np.testing.assert_array_equal(values, sent)


def test_padding_is_ignored_when_a_foreign_writer_fills_it() -> None:
    """After "ab" and its NUL stands one byte of padding."""
    description = FramedStates("ab", ["x"])
    data = bytearray(CompiledCodec(description).encode(5, np.arange(3.0)))
    place = data.index(b"ab\0") + 3
    data[place] = 0xAA
    values = np.zeros(3)
    assert CompiledCodec(description).read(bytes(data), values) == 5
    assert values.tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize(
    "other",
    [("abd", ["left", "r"], 2), ("abc", ["left", "s"], 2), ("abc", ["left", "r"], 1), ("", [], 0)],
)
def test_another_layout_is_refused_and_nothing_taken(other: tuple[str, list[str], int]) -> None:
    values = np.array([5.0, 6.0, 7.0, 8.0, 9.0, 1.0])
    codec = CompiledCodec(FramedStates("abc", ["left", "r"]))
    assert codec.read(joint_state(*other).data, values) == FOREIGN
    assert values.tolist() == [5.0, 6.0, 7.0, 8.0, 9.0, 1.0]


def test_what_is_cut_short_or_big_endian_is_no_message_of_the_layout() -> None:
    description, values = FramedStates("abc", ["left"]), np.zeros(3)
    data, codec = CompiledCodec(description).encode(0, np.ones(3)), CompiledCodec(description)
    for given_data in (data[:-1], b"", b"\x00\x00" + data[2:]):
        assert codec.read(given_data, values) == FOREIGN
    assert not values.any()


@given(st.sampled_from(topics.ALL), st.binary(max_size=200))
def test_garbage_has_a_tick_or_is_refused(topic: topics.Topic, garbage: bytes) -> None:
    """Whatever a foreign publisher sends: the recorder asks every message for its tick."""
    for data in (garbage, ENCAPSULATION + garbage):
        with contextlib.suppress(MessageError):
            assert message_tick(topic, data, Timebase(500_000)) >= 0
