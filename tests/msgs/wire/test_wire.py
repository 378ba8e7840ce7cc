"""Every byte of a message counts: what the codecs read is what rosbags reads, or it is refused.

The codecs compare a message with the layout they know and copy its numbers; here each byte of it is
changed in turn, and a decoder that knows no layout tells what the changed message says.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from random_samples import BASE_AXES, TIMEBASE, joint_names, random_sample
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Command, ReferenceChunk, RobotNames, RobotState
from space_robot_msgs_py.wire import message as general_way
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec

Array = NDArray[np.float64]
Read = tuple[int, bytes] | None
"""Tick and numbers of a message, bit for bit; None if it is refused."""

STORE = get_typestore(Stores.ROS2_JAZZY)
NAMES = joint_names(2)
AXES = BASE_AXES + NAMES


def general(data: bytes, type_name: str) -> Any:
    """The message as rosbags reads it, by its encapsulation: big or little endian, plain CDR."""
    definition = STORE.get_msgdef(type_name)
    endian = {b"\0\0": definition.deserialize_cdr_be, b"\0\1": definition.deserialize_cdr_le}
    if data[:2] not in endian:
        raise ValueError(data[:2])
    return endian[data[:2]](data[4:], 0, definition.cls, STORE)[0]


def tick_of(stamp: Any) -> int:
    tick, rest = divmod(stamp.sec * 10**9 + stamp.nanosec, TIMEBASE.period_ns)
    if rest or tick < 0:
        raise ValueError(stamp)
    return int(tick)


def numbers(*parts: Any) -> bytes:
    return np.concatenate([np.ravel(np.asarray(part, dtype=float)) for part in parts]).tobytes()


def vector(value: Any) -> list[float]:
    return [value.x, value.y, value.z]


def in_order(values: Any, names: list[str], expected: list[str]) -> Array:
    """The values of the expected names, each of which must be there once."""
    if sorted(names) != sorted(expected) or len(values) != len(names):
        raise ValueError(names)
    return np.asarray(values)[[names.index(name) for name in expected]]


def expect_joints(data: bytes) -> Read:
    message = general(data, topics.JOINT_STATES.type)
    columns = (message.position, message.velocity, message.effort)
    arrays = [in_order(column, message.name, NAMES) for column in columns]
    return tick_of(message.header.stamp), numbers(*arrays)


def read_joints(codec: StateCodec, data: bytes) -> Read:
    state = RobotState.allocate(2)
    tick = codec.decode(topics.JOINT_STATES, data, state)
    arrays = (state.joint_positions, state.joint_velocities, state.applied_torque[3:])
    return tick, numbers(*arrays)


def expect_base(data: bytes) -> Read:
    message = general(data, topics.BASE_STATE.type)
    (transform,), (twist,), (wrench,) = message.transforms, message.twist, message.wrench
    in_order([0.0], message.joint_names, ["base"])
    rotation = [transform.rotation.w, *vector(transform.rotation)]
    parts = (vector(transform.translation), rotation, vector(twist.linear), vector(twist.angular))
    return tick_of(message.header.stamp), numbers(*parts, vector(wrench.torque))


def read_base(codec: StateCodec, data: bytes) -> Read:
    state = RobotState.allocate(2)
    tick = codec.decode(topics.BASE_STATE, data, state)
    parts = (state.base_position, state.quaternion, state.base_velocity, state.omega_base)
    return tick, numbers(*parts, state.applied_torque[:3])


def expect_command(data: bytes) -> Read:
    message = general(data, topics.COMMAND.type)
    return tick_of(message.header.stamp), numbers(in_order(message.effort, message.name, AXES))


def read_command(codec: CommandCodec, data: bytes) -> Read:
    command = Command(-1, np.zeros(5))
    codec.decode(data, command)
    return command.tick, numbers(command.torque)


def check_spacing(points: Any) -> None:
    if not points or [tick_of(point.time_from_start) for point in points] != [*range(len(points))]:
        raise ValueError(points)


def expect_reference_joints(data: bytes) -> Read:
    message = general(data, topics.REFERENCE_JOINTS.type)
    check_spacing(message.points)
    rows = [
        [
            in_order(column, message.joint_names, NAMES)
            for column in (point.positions, point.velocities, point.accelerations)
        ]
        for point in message.points
    ]
    return tick_of(message.header.stamp), numbers(rows)


def read_reference_joints(codec: ReferenceCodec, data: bytes) -> Read:
    tick, rows = codec.decode_joints(data)
    return tick, numbers(rows)


def expect_reference_base(data: bytes) -> Read:
    message = general(data, topics.REFERENCE_BASE.type)
    in_order([0.0], message.joint_names, ["base"])
    check_spacing(message.points)
    rows = []
    for point in message.points:
        q, rate, acceleration = point.transforms[0], point.velocities[0], point.accelerations[0]
        rows.append(
            [
                q.rotation.w,
                *vector(q.rotation),
                *vector(rate.angular),
                *vector(acceleration.angular),
            ]
        )
    return tick_of(message.header.stamp), numbers(rows)


def read_reference_base(codec: ReferenceCodec, data: bytes) -> Read:
    tick, rows = codec.decode_base(data)
    return tick, numbers(rows)


def chunk() -> ReferenceChunk:
    rng = np.random.default_rng(3)
    return ReferenceChunk(100, rng.normal(size=(3, 3, 2)), rng.normal(size=(3, 10)))


def make_state_codec() -> StateCodec:
    return StateCodec(RobotNames.of(NAMES), TIMEBASE)


def make_command_codec() -> CommandCodec:
    return CommandCodec(AXES, TIMEBASE)


def make_reference_codec() -> ReferenceCodec:
    """One that knows the layout of three points."""
    codec = ReferenceCodec(NAMES, TIMEBASE)
    codec.encode(chunk())
    return codec


STATE = make_state_codec().encode(random_sample(2, 1))
REFERENCE = make_reference_codec().encode(chunk())
TOPICS: dict[str, tuple[bytes, Callable[[], Any], Any, Any]] = {
    "joints": (STATE[0], make_state_codec, read_joints, expect_joints),
    "base": (STATE[1], make_state_codec, read_base, expect_base),
    "command": (
        make_command_codec().encode(Command(7, np.arange(5.0) - 2.5)),
        make_command_codec,
        read_command,
        expect_command,
    ),
    "reference joints": (
        REFERENCE[0],
        make_reference_codec,
        read_reference_joints,
        expect_reference_joints,
    ),
    "reference base": (
        REFERENCE[1],
        make_reference_codec,
        read_reference_base,
        expect_reference_base,
    ),
}
EVERY = pytest.mark.parametrize("topic", list(TOPICS))


def changed(data: bytes) -> Iterator[tuple[str, bytes]]:
    """The message with one byte changed, each in turn: a low bit, the highest, all bits."""
    for place in range(len(data)):
        for bits in (0x01, 0x80, 0xFF):
            other = bytearray(data)
            other[place] ^= bits
            yield f"byte {place} of {len(data)} with {bits:#x}", bytes(other)


def by_codec(read: Any, codec: Any, data: bytes) -> Read:
    try:
        result: Read = read(codec, data)
    except MessageError:
        return None
    return result


def by_rosbags(expect: Any, data: bytes) -> Read:
    try:
        result: Read = expect(data)
    except (struct.error, ValueError, IndexError, SerdeError):  # numpy's and our own among them
        return None
    return result


@EVERY
@pytest.mark.parametrize("one_codec", [False, True], ids=["anew", "one codec for all"])
def test_a_message_with_one_byte_changed_is_read_as_it_says_or_refused(
    topic: str, one_codec: bool
) -> None:
    """Encapsulation, names, lengths, numbers to the bit, padding; whatever was read before."""
    data, make, read, expect = TOPICS[topic]
    codec = make()
    refused = 0
    for what, message in changed(data):
        given = by_codec(read, codec if one_codec else make(), message)
        assert given == by_rosbags(expect, message), what
        refused += given is None
        if one_codec:
            assert by_codec(read, codec, data) == by_rosbags(expect, data), f"after {what}"
    assert refused > 50, "names and lengths matter"


@EVERY
def test_a_message_of_another_encapsulation_is_not_taken_for_ours(topic: str) -> None:
    """Big endian, parameter lists, and the layouts of newer CDR, which align otherwise."""
    data, make, read, _ = TOPICS[topic]
    for kind in (b"\0\0", b"\0\2", b"\0\3", b"\0\6", b"\0\7", b"\0\x0a", b"\1\1", b"\xff\xff"):
        assert by_codec(read, make(), kind + data[2:]) is None, kind


@EVERY
def test_a_message_written_big_endian_is_read(topic: str) -> None:
    data, make, read, _ = TOPICS[topic]
    types = {
        "joints": topics.JOINT_STATES,
        "base": topics.BASE_STATE,
        "command": topics.COMMAND,
        "reference joints": topics.REFERENCE_JOINTS,
        "reference base": topics.REFERENCE_BASE,
    }
    type_name = types[topic].type
    turned = STORE.serialize_cdr(general(data, type_name), type_name, little_endian=False)
    assert bytes(turned[:2]) == b"\0\0"
    assert by_codec(read, make(), bytes(turned)) == by_codec(read, make(), data) is not None


@EVERY
def test_a_message_cut_short_anywhere_is_refused(topic: str) -> None:
    data, make, read, _ = TOPICS[topic]
    codec = make()
    for length in range(len(data)):
        assert by_codec(read, codec, data[:length]) is None, length
    assert by_codec(read, codec, data) is not None


@EVERY
@pytest.mark.parametrize("tail", [b"", b"\xaa" * 9])
def test_our_own_layout_is_read_without_the_general_decoder(
    topic: str, tail: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is slower by a hundred times: at 2 kHz that is the whole tick."""
    data, make, read, expect = TOPICS[topic]
    codec = make()
    monkeypatch.setattr(general_way, "decode", lambda *_: pytest.fail("the general decoder"))
    assert by_codec(read, codec, data + tail) == by_rosbags(expect, data)


def test_a_foreign_frame_is_learnt_from_its_first_message(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its second one is read the fast way."""
    data, make, read, _ = TOPICS["joints"]
    given = general(data, topics.JOINT_STATES.type)
    given.header.frame_id = "somewhere"
    foreign = bytes(STORE.serialize_cdr(given, topics.JOINT_STATES.type))
    codec, expected = make(), read(make(), data)
    assert read(codec, foreign) == expected
    monkeypatch.setattr(general_way, "decode", lambda *_: pytest.fail("the general decoder"))
    assert read(codec, foreign) == expected


def renamed(names: list[str], topic: topics.Topic, data: bytes) -> bytes:
    message = general(data, topic.type)
    message.joint_names = names
    return bytes(STORE.serialize_cdr(message, topic.type))


@pytest.mark.parametrize("names", [["arm"], [], ["base", "base"], ["base", "arm"], ["Base"]])
def test_a_base_of_another_name_is_an_error_that_names_both(names: list[str]) -> None:
    """In the state and in the reference."""
    for topic, decode in (
        (
            topics.BASE_STATE,
            lambda d: make_state_codec().decode(topics.BASE_STATE, d, RobotState.allocate(2)),
        ),
        (topics.REFERENCE_BASE, make_reference_codec().decode_base),
    ):
        data = STATE[1] if topic is topics.BASE_STATE else REFERENCE[1]
        with pytest.raises(
            MessageError, match=rf"^{topic.full_name}: names .* expected \['base'\]"
        ):
            decode(renamed(names, topic, data))
