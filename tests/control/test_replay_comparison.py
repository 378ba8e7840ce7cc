"""Commands of a replay beside the recorded ones: what is equal, what differs, what is missing."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_control.flight.replay.commands import CommandList, Commands
from space_robot_control.flight.replay.comparison import Comparison
from space_robot_msgs_py.codecs import CommandCodec
from space_robot_msgs_py.definitions import decode, jazzy
from space_robot_msgs_py.samples import Command, Timebase

AXES = ("base_x", "base_y", "base_z", "joint1", "joint2")
TIMEBASE = Timebase(500_000)
TYPE = "sensor_msgs/msg/JointState"


def torque_of(tick: int) -> np.ndarray:
    return np.sin(tick + np.arange(5.0))


def messages(ticks: Iterable[int]) -> dict[int, bytes]:
    codec = CommandCodec(AXES, TIMEBASE)
    return {tick: codec.encode(Command(tick, torque_of(tick))) for tick in ticks}


def commands(data: Iterable[bytes]) -> Commands:
    taken = CommandList(AXES, TIMEBASE)
    for message in data:
        taken.add(message)
    return taken.commands()


def compare(recorded: Iterable[bytes], replayed: Iterable[bytes], played: int) -> Comparison:
    return Comparison(AXES, np.arange(played), commands(recorded), commands(replayed))


def test_the_same_messages_are_identical() -> None:
    sent = messages(range(20))
    same = compare(sent.values(), sent.values(), 20)
    assert same.is_identical
    assert same.first_difference() is None
    assert np.all(same.difference == 0.0)


@given(tick=st.integers(0, 19), axis=st.integers(0, 4), bit=st.integers(0, 63))
def test_one_bit_is_found_where_it_was_changed(tick: int, axis: int, bit: int) -> None:
    """Whatever bit: of the mantissa's end, of the sign of zero, or one that makes it a NaN."""
    sent = messages(range(20))
    torque = torque_of(tick)
    torque.view(np.uint64)[axis] ^= np.uint64(1 << bit)
    changed = {**sent, tick: CommandCodec(AXES, TIMEBASE).encode(Command(tick, torque))}
    compared = compare(sent.values(), changed.values(), 20)
    assert not compared.is_identical
    assert np.count_nonzero(~compared.equal) == 1
    found = compared.first_difference()
    assert found is not None
    assert found[0] == tick
    assert [difference.field for difference in found[1]] == [f"effort[{AXES[axis]}]"]
    report = compared.report(TIMEBASE.period)
    assert report["first_difference"]["fields"][0]["recorded"] == torque_of(tick)[axis]
    assert report["axes"][AXES[axis]]["recorded_rms"] > 0.0


@given(recorded=st.sets(st.integers(0, 12)), replayed=st.sets(st.integers(0, 12)))
def test_every_tick_is_accounted_for(recorded: set[int], replayed: set[int]) -> None:
    compared = compare(messages(recorded).values(), messages(replayed).values(), 10)
    known = {tick for tick in recorded if tick < 10}
    assert set(compared.ticks.tolist()) == known & replayed
    assert set(compared.unanswered.tolist()) == known - replayed
    assert set(compared.unrecorded.tolist()) == replayed - recorded
    assert compared.without_state == len(recorded - known)
    assert compared.is_identical == (recorded == replayed == known != set())
    ticks, *torques = compared.table()
    assert set(ticks.tolist()) == replayed | known
    for torque, there in zip(torques, (recorded, replayed), strict=True):
        has = [tick in there for tick in ticks.tolist()]
        np.testing.assert_array_equal(np.isfinite(torque).all(axis=1), has)


def foreign(data: bytes, **changes: object) -> bytes:
    message = decode(data, TYPE)
    for name, value in changes.items():
        if name == "frame_id":
            message.header.frame_id = value
        else:
            setattr(message, name, value)
    return bytes(jazzy().serialize_cdr(message, TYPE))


@pytest.mark.parametrize(
    ("changes", "fields"),
    [
        ({"frame_id": "body"}, ["frame_id"]),
        ({"position": np.zeros(5)}, ["position"]),
        ({"name": [*AXES[:3], "joint2", "joint1"]}, ["name", "effort[joint1]", "effort[joint2]"]),
    ],
)
def test_other_fields_are_compared_too(changes: dict[str, object], fields: list[str]) -> None:
    sent = messages(range(3))
    other = {**sent, 1: foreign(sent[1], **changes)}
    found = compare(sent.values(), other.values(), 3).first_difference()
    assert found is not None
    assert (found[0], [difference.field for difference in found[1]]) == (1, fields)


def test_a_command_for_other_axes_differs_and_does_not_stop_the_rest() -> None:
    sent = messages(range(3))
    other = {**sent, 1: foreign(sent[1], name=["a", "b"], effort=np.ones(2))}
    compared = compare(other.values(), sent.values(), 3)
    assert compared.equal.tolist() == [True, False, True]
    json.dumps(compared.report(TIMEBASE.period)["axes"], allow_nan=False)


@pytest.mark.parametrize("spoil", [lambda m: b"", lambda m: m[:40], lambda m: m[:8] + b"?" * 9])
def test_what_is_no_command_is_counted(spoil: Callable[[bytes], bytes]) -> None:
    sent = messages(range(4))
    compared = compare({**sent, 3: spoil(sent[3])}.values(), messages(range(3)).values(), 4)
    assert not compared.is_identical
    assert compared.equal.tolist() == [True, True, True]
    report = compared.report(TIMEBASE.period)
    assert report["unreadable"] == {"recorded": 1, "replayed": 0}


def test_the_first_answer_to_a_tick_counts() -> None:
    """One that was asked for again is the same, or the plant has used the first."""
    sent = messages(range(3))
    again = CommandCodec(AXES, TIMEBASE).encode(Command(1, np.zeros(5)))
    assert compare(sent.values(), [*sent.values(), again], 3).is_identical
