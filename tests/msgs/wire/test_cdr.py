"""Messages laid out as rosbags writes them; stamps that are believed."""

from __future__ import annotations

import contextlib
from itertools import pairwise
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
from space_robot_msgs_py.wire.codecs import CompiledCodec
from space_robot_msgs_py.wire.messages import Codec, MessageDescription, describe
from space_robot_msgs_py.wire.stamp_guard import AGREEING, StampGuard
from space_robot_msgs_py.wire.viewers import (
    POSE,
    FramePair,
    TransformsCodec,
    robot_description,
    unwrap,
    wrap,
)

TIMEBASE = Timebase(500_000)
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


def numbers(data: bytes, slot: Slot) -> NDArray[np.float64]:
    return np.frombuffer(data, np.float64, slot.length, slot.offset)


def framed_states(frame: str, joints: list[str]) -> MessageDescription:
    """With a frame, so that the numbers stand elsewhere."""
    return describe(topics.JOINT_STATES._replace(frame=frame), joints, Timebase(1))


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


@given(texts, names, stamps)
def test_any_names_are_written_as_rosbags_does_and_read(
    frame: str, joints: list[str], stamp_ns: int
) -> None:
    """By both codecs, for strings of any length and script, and seconds below zero."""
    values = np.arange(3 * len(joints)) + 0.25
    types = STORE.types
    time = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
    header = types["std_msgs/msg/Header"](time, frame)
    theirs = types["sensor_msgs/msg/JointState"](header, joints, *values.reshape(3, -1))
    expected = bytes(STORE.serialize_cdr(theirs, "sensor_msgs/msg/JointState"))
    for codec in (Codec(framed_states(frame, joints)), CompiledCodec(framed_states(frame, joints))):
        assert codec.encode(stamp_ns, values) == expected
    back = np.empty_like(values)
    assert CompiledCodec(framed_states(frame, joints)).decode(expected, back) == stamp_ns
    np.testing.assert_array_equal(back, values)
    stamp, numbers_read = Codec(framed_states(frame, joints)).decode(expected)
    assert stamp == header_stamp_ns(expected) == stamp_ns
    np.testing.assert_array_equal(numbers_read, values)


@given(st.sampled_from(topics.ALL), st.binary(max_size=200))
def test_garbage_has_a_tick_or_is_refused(topic: topics.Topic, garbage: bytes) -> None:
    """Whatever a foreign publisher sends: the recorder asks every message for its tick."""
    for data in (garbage, ENCAPSULATION + garbage):
        with contextlib.suppress(MessageError):
            assert message_tick(topic, data, TIMEBASE) >= 0


@given(st.lists(st.builds(FramePair, texts, texts), max_size=6), st.integers(0, 10**9), seeds)
def test_transforms_are_the_bytes_of_rosbags(frames: list[FramePair], tick: int, seed: int) -> None:
    """Of a codec that has written another message before."""
    rng, codec = np.random.default_rng(seed), TransformsCodec(frames, TIMEBASE)
    codec.encode(7, rng.normal(size=(len(frames), POSE)))
    poses = rng.normal(size=(len(frames), POSE))
    data = codec.encode(tick, poses)
    message = STORE.deserialize_cdr(data, topics.TF.type)
    assert bytes(STORE.serialize_cdr(message, topics.TF.type)) == data
    for frame, pose, one in zip(frames, poses, message.transforms, strict=True):
        assert (one.header.frame_id, one.child_frame_id) == (frame.parent, frame.child)
        assert one.header.stamp.sec * 10**9 + one.header.stamp.nanosec == TIMEBASE.stamp_ns(tick)
        v, q = one.transform.translation, one.transform.rotation
        assert pose.tolist() == [v.x, v.y, v.z, q.x, q.y, q.z, q.w]


@given(st.binary(max_size=99))
def test_a_carrier_is_a_message_of_ros(data: bytes) -> None:
    message = STORE.deserialize_cdr(wrap(data), topics.TRANSFORMS.type)
    assert bytes(message.data) == unwrap(wrap(data)) == data


@given(st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=99))
def test_a_description_is_read_back(text: str) -> None:
    """Whole words: so the middleware adds nothing, and all bags have the same bytes."""
    data = robot_description(text)
    read = STORE.deserialize_cdr(data, "std_msgs/msg/String").data
    assert read in {text + count * "\n" for count in range(4)}
    assert len(data) % 4 == 0
    message = STORE.types["std_msgs/msg/String"](read)
    assert bytes(STORE.serialize_cdr(message, "std_msgs/msg/String")) == data


# Strange stamps

JUMP = 8

steps = st.lists(st.integers(1, JUMP), max_size=30)
any_ticks = st.lists(st.integers(0, 40) | st.integers(0, 10**9), max_size=40)


def rising(begin: int, steps: list[int]) -> list[int]:
    found = [begin]
    for step in steps:
        found.append(found[-1] + step)
    return found


def passing(guard: StampGuard, ticks: list[int]) -> list[bool]:
    return [guard.passes(tick) for tick in ticks]


@given(st.integers(0, 10**6), steps, st.integers(0, 10**9), st.integers(0, 29), st.integers(1, 4))
def test_fewer_strange_ones_than_agreeing_are_not(
    begin: int, steps: list[int], strange: int, where: int, many: int
) -> None:
    """The stream goes on as if they had not come."""
    ticks = rising(begin, steps)
    where = min(where, len(ticks) - 1)
    last = ticks[where]
    if 0 < strange - last <= JUMP:
        strange = last
    guard = StampGuard(JUMP)
    passing(guard, ticks[: where + 1])
    assert not any(passing(guard, [strange] * min(many, AGREEING - 1)))
    assert guard.last == last
    assert all(passing(guard, ticks[where + 1 :]))


@given(any_ticks)
def test_a_strange_stamp_is_only_believed_after_others_that_fit_it(ticks: list[int]) -> None:
    """Any stream: the ones before it were all refused, and lead up to it."""
    guard = StampGuard(JUMP)
    verdicts: list[bool] = []
    for i, tick in enumerate(ticks):
        last = guard.last
        verdicts.append(guard.passes(tick))
        if i == 0 or 0 < tick - last <= JUMP:
            assert verdicts[i]
        elif verdicts[i]:
            run = ticks[i - AGREEING + 1 : i + 1]
            assert len(run) == AGREEING
            assert not any(verdicts[i - AGREEING + 1 : i])
            assert all(0 <= b - a <= JUMP for a, b in pairwise(run))


@given(any_ticks, st.integers(0, 10**9), steps)
def test_a_new_time_is_believed_by_its_fifth_stamp_at_the_latest(
    past: list[int], begin: int, steps: list[int]
) -> None:
    """Whatever has come before: the plant has started anew."""
    guard = StampGuard(JUMP)
    passing(guard, past)
    verdicts = passing(guard, rising(begin, [1] * AGREEING + steps))
    assert any(verdicts[:AGREEING])
    assert all(verdicts[AGREEING - 1 :])


@given(st.integers(0, 10**6), st.integers(0, 10**9))
def test_a_new_time_is_told_as_one_and_only_once(begin: int, new: int) -> None:
    guard = StampGuard(JUMP)
    guard.passes(begin)
    if 0 < new - begin <= JUMP:
        new = begin
    passing(guard, [new] * AGREEING)
    assert guard.last == new
    assert guard.is_new_time
    assert guard.passes(new + 1)
    assert not guard.is_new_time
