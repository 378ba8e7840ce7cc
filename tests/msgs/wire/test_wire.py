"""Every byte of a message counts: what the codecs read is what rosbags reads, or it is refused.

The codecs compare a message with the layout they know and copy its numbers; here each byte of it is
changed in turn, other programs write it, and a decoder that knows no layout tells what it says.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_samples import TIMEBASE, joint_names, ros_type, serialization
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Command, ReferenceChunk, RobotNames, RobotState
from space_robot_msgs_py.wire import messages as general_way
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.telemetry import ReferenceCodec

Read = tuple[int, bytes] | None
"""Tick and numbers of a message, bit for bit; None if it is refused."""
STORE = get_typestore(Stores.ROS2_JAZZY)
NAMES = tuple(joint_names(2))
ROBOT = RobotNames(NAMES, ("w1", "w2"), ("t1", "t2"), geared=NAMES, torquers=("m1",))


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


def in_order(values: Any, names: Sequence[str], expected: Sequence[str]) -> Array:
    """The values of the expected names, each of which must be there once."""
    if sorted(names) != sorted(expected) or len(values) != len(names):
        raise ValueError(names)
    return np.asarray(values)[[list(names).index(name) for name in expected]]


def expect_named(names: Sequence[str], columns: Sequence[str], message: Any) -> list[Any]:
    """What a JointState says of these names."""
    return [in_order(getattr(message, column), message.name, names) for column in columns]


def expect_base(message: Any) -> list[Any]:
    (transform,), (twist,), (wrench,) = message.transforms, message.twist, message.wrench
    in_order([0.0], message.joint_names, ["base"])
    rotation = [transform.rotation.w, *vector(transform.rotation)]
    parts = [vector(transform.translation), rotation, vector(twist.linear), vector(twist.angular)]
    return [*parts, vector(wrench.torque)]


def check_spacing(points: Any) -> None:
    if not points or [tick_of(point.time_from_start) for point in points] != [*range(len(points))]:
        raise ValueError(points)


def expect_reference_joints(message: Any) -> list[Any]:
    check_spacing(message.points)
    fields = ("positions", "velocities", "accelerations")
    return [
        in_order(getattr(point, field), message.joint_names, NAMES)
        for point in message.points
        for field in fields
    ]


def expect_reference_base(message: Any) -> list[Any]:
    in_order([0.0], message.joint_names, ["base"])
    check_spacing(message.points)
    rows: list[Any] = []
    for point in message.points:
        q, rate, change = point.transforms[0], point.velocities[0], point.accelerations[0]
        rows.append([q.rotation.w, *vector(q.rotation), *vector(rate.angular)])
        rows.append(vector(change.angular))
    return rows


def read_state(
    topic: topics.Topic, parts: Callable[[RobotState], list[Any]], codec: Any, data: bytes
) -> Read:
    state = RobotState.allocate(2)
    return codec.decode(topic, data, state), numbers(*parts(state))


def read_command(codec: CommandCodec, data: bytes) -> Read:
    command = Command(-1, np.zeros(len(ROBOT.commanded)))
    codec.decode(data, command)
    return command.tick, numbers(command.torque)


def read_reference(method: str, codec: ReferenceCodec, data: bytes) -> Read:
    tick, rows = getattr(codec, method)(data)
    return tick, numbers(rows)


def chunk() -> ReferenceChunk:
    rng = np.random.default_rng(3)
    return ReferenceChunk(100, rng.normal(size=(3, 3, 2)), rng.normal(size=(3, 10)))


def reference_codec() -> ReferenceCodec:
    """One that knows the layout of three points."""
    codec = ReferenceCodec(NAMES, TIMEBASE)
    codec.encode(chunk())
    return codec


@dataclass
class Case:
    """A message, and how it is read by its codec and by rosbags."""

    topic: topics.Topic
    data: bytes
    make: Callable[[], Any]
    read: Callable[[Any, bytes], Read]
    parts: Callable[[Any], list[Any]]

    def by_codec(self, data: bytes, codec: Any = None) -> Read:
        try:
            return self.read(codec or self.make(), data)
        except MessageError:
            return None

    def by_rosbags(self, data: bytes) -> Read:
        try:
            message = general(data, self.topic.type)
            return tick_of(message.header.stamp), numbers(*self.parts(message))
        except (struct.error, ValueError, IndexError, SerdeError):  # numpy's and our own among them
            return None

    def message(self) -> Any:
        return general(self.data, self.topic.type)

    def written(self, message: Any, little_endian: bool = True) -> bytes:
        return bytes(STORE.serialize_cdr(message, self.topic.type, little_endian=little_endian))


STATES: dict[topics.Topic, tuple[Callable[[Any], list[Any]], Callable[[RobotState], list[Any]]]] = {
    topics.JOINT_STATES: (
        partial(expect_named, NAMES, ("position", "velocity", "effort")),
        lambda s: [s.joint_positions, s.joint_velocities, s.applied_torque[3:]],
    ),
    topics.BASE_STATE: (
        expect_base,
        lambda s: [
            *(s.base_position, s.quaternion, s.base_velocity, s.omega_base),
            s.applied_torque[:3],
        ],
    ),
    topics.WHEELS_STATE: (
        partial(expect_named, ROBOT.wheels, ("velocity", "effort")),
        lambda s: [s.wheel_velocities[:2], s.wheel_torques[:2]],
    ),
    topics.THRUSTERS_STATE: (
        partial(expect_named, ROBOT.thrusters, ("effort",)),
        lambda s: [s.thrusts[:2]],
    ),
    topics.MOTORS_STATE: (
        partial(expect_named, NAMES, ("position", "velocity")),
        lambda s: [s.motor_positions[:2], s.motor_velocities[:2]],
    ),
    topics.MAGNETOMETER: (
        lambda message: [vector(message.magnetic_field)],
        lambda s: [s.magnetic_field],
    ),
}


def cases() -> Iterator[Case]:
    state, make = RobotState.allocate(2), partial(StateCodec, ROBOT, TIMEBASE)
    state.numbers[:], state.tick = np.random.default_rng(1).normal(size=state.numbers.shape), 4001
    for topic, data in zip(make().topics, make().encode(state), strict=True):
        expect, parts = STATES[topic]
        yield Case(topic, data, make, partial(read_state, topic, parts), expect)
    yield Case(
        topics.COMMAND,
        CommandCodec(ROBOT.commanded, TIMEBASE).encode(Command(7, np.arange(10.0) - 2.5)),
        partial(CommandCodec, ROBOT.commanded, TIMEBASE),
        read_command,
        partial(expect_named, ROBOT.commanded, ("effort",)),
    )
    joints, base = reference_codec().encode(chunk())
    read = partial(read_reference, "decode_joints")
    yield Case(topics.REFERENCE_JOINTS, joints, reference_codec, read, expect_reference_joints)
    read = partial(read_reference, "decode_base")
    yield Case(topics.REFERENCE_BASE, base, reference_codec, read, expect_reference_base)


CASES = {case.topic.name: case for case in cases()}
EVERY = pytest.mark.parametrize("case", CASES.values(), ids=CASES)


@EVERY
def test_a_message_with_one_byte_changed_is_read_as_it_says_or_refused(case: Case) -> None:
    """Encapsulation, names, lengths, numbers to the bit, padding; whatever was read before."""
    codec, refused = case.make(), 0
    own = case.by_codec(case.data)
    assert own == case.by_rosbags(case.data) is not None
    for place in range(len(case.data)):
        for bits in (0x01, 0x80, 0xFF):
            changed = bytearray(case.data)
            changed[place] ^= bits
            expected = case.by_rosbags(bytes(changed))
            assert case.by_codec(bytes(changed), codec) == expected, (place, bits)
            if bits == 0xFF:
                assert case.by_codec(bytes(changed)) == expected, (place, bits)
                assert case.by_codec(case.data, codec) == own, f"after {place}"
            refused += expected is None
    assert refused > 20, "names and lengths matter"


@EVERY
def test_other_encapsulations_and_lengths(case: Case) -> None:
    """Big endian is read; newer CDR, which aligns otherwise, and what is cut anywhere is not."""
    own = case.by_codec(case.data)
    assert case.by_codec(case.written(case.message(), little_endian=False)) == own
    for kind in (b"\0\0", b"\0\2", b"\0\3", b"\0\6", b"\0\7", b"\0\x0a", b"\1\1", b"\xff\xff"):
        assert case.by_codec(kind + case.data[2:]) is None, kind
    codec = case.make()
    for length in range(len(case.data)):
        assert case.by_codec(case.data[:length], codec) is None, length
    for tail in (b"\0", b"\xff" * 3, b"\x7f" * 40):
        assert case.by_codec(case.data + tail, codec) == own


@EVERY
def test_ros_reads_it_and_what_ros_writes_is_read(case: Case) -> None:
    """Though empty arrays make rclpy's messages longer than they are."""
    kind = ros_type(case.topic.type)
    message = serialization().deserialize_message(case.data, kind)
    data = bytes(serialization().serialize_message(message))
    assert case.by_codec(data) == case.by_codec(case.data)


def foreign(case: Case, frame: str, order: Sequence[int]) -> bytes:
    """The same message in another frame, its names in another order, unused fields filled."""
    message = case.message()
    message.header.frame_id = frame
    if case.topic is topics.MAGNETOMETER:
        message.magnetic_field_covariance = np.arange(9.0)
        return case.written(message)
    key = "name" if hasattr(message, "name") else "joint_names"
    if len(names := getattr(message, key)) > 1:
        own = [k for k in order if k < len(names)]
        setattr(message, key, [names[k] for k in own])
        for part in getattr(message, "points", [message]):
            for field in ("position", "velocity", "acceleration", "effort"):
                for name in (field, f"{field}s", f"{field[:-1]}ies"):
                    if len(values := getattr(part, name, ())):
                        setattr(part, name, values[own])
            if part is not message:
                part.effort = np.ones(len(own))
    return case.written(message)


@EVERY
@settings(max_examples=10)
@given(frame=st.sampled_from(["", "world", "inertial/x"]), order=st.permutations(range(10)))
def test_names_are_taken_in_any_order_whatever_the_frame(
    case: Case, frame: str, order: list[int]
) -> None:
    """The second message of a layout is read the fast way; the own one stays readable."""
    data, own = foreign(case, frame, order), case.by_codec(case.data)
    codec, fresh = case.make(), case.make()
    assert own is not None
    assert case.by_codec(data, codec) == own
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(general_way, "decode", lambda *_: pytest.fail("the general decoder"))
        assert case.by_codec(data, codec) == own
        for tail in (b"", b"\xaa" * 9):  # a hundred times slower otherwise
            assert case.by_codec(case.data + tail, fresh) == own
    for again in (data + b"\xaa" * 9, case.data):
        assert case.by_codec(again, codec) == own


def _names(names: list[str]) -> Callable[[Any], None]:
    def change(message: Any) -> None:
        if not hasattr(message, "name"):
            message.joint_names = names
            return
        message.name = names
        for field in ("position", "velocity", "effort"):
            if len(getattr(message, field)):
                setattr(message, field, np.ones(len(names)))

    return change


def _set(path: str, value: Any) -> Callable[[Any], None]:
    def change(message: Any) -> None:
        *parents, name = path.split(".")
        for parent in parents:
            message = message[int(parent)] if parent.isdigit() else getattr(message, parent)
        setattr(message, name, value)

    return change


SHORT = np.ones(1)
TWO = list(NAMES)
APART = "point 1 is not 1 ticks after"


@pytest.mark.parametrize(
    ("topic", "change", "said"),
    [
        *(
            ("joint_states", _names(names), f"names {names!r}, expected {TWO!r}")
            for names in (["a", "c"], ["a"], [*TWO, "c"], ["a", "a"], [])
        ),
        ("joint_states", _set("velocity", SHORT), "1 values of velocity for 2 names"),
        ("wheels/state", _names(["w1"]), "names"),
        ("thrusters/state", _names(["t1", "x"]), "names"),
        ("motors/state", _names(TWO[:1]), "names"),
        ("command", _names(TWO), "names"),
        *(
            (topic, _names(names), "expected ['base']")
            for topic in ("base/state", "reference/base")
            for names in (["arm"], [], ["base", "base"], ["base", "arm"], ["Base"])
        ),
        *(
            ("base/state", _set(name, []), f"0 values of {name} for 1 names")
            for name in ("transforms", "twist", "wrench")
        ),
        ("reference/joints", _names(["a", "c"]), f"expected {TWO!r}"),
        ("reference/joints", _set("points", []), ""),
        *(
            (
                "reference/joints",
                _set(f"points.{k}.{name}", SHORT),
                f"1 values of {name} for 2 names",
            )
            for k in (0, 2)
            for name in ("positions", "velocities", "accelerations")
        ),
        ("reference/base", _set("points", []), ""),
        ("reference/base", _set("points.1.accelerations", []), ""),
        *(
            (topic, _set("points.1.time_from_start.nanosec", 1_000_000), APART)
            for topic in ("reference/joints", "reference/base")
        ),
        *(
            (topic, _set("header.stamp.nanosec", 500_001), "is not a whole number of 500000 ns")
            for topic in CASES
        ),
    ],
)
def test_what_does_not_fit_is_refused_by_name_and_the_next_is_read(
    topic: str, change: Callable[[Any], None], said: str
) -> None:
    case = CASES[topic]
    codec, message = case.make(), case.message()
    own = case.by_codec(case.data, codec)
    change(message)
    for reader in (codec, case.make()):
        with pytest.raises(MessageError) as error:
            case.read(reader, case.written(message))
        assert said in str(error.value)
        assert (
            case.topic.full_name in str(error.value) or "stamp" in said or not said or "ns" in said
        )
    assert case.by_codec(case.data, codec) == own is not None
