"""Commands of a replay beside the recorded ones: what is equal, what differs, what is missing."""

from __future__ import annotations

import json
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from space_robot.flight.replay.comparison import CommandList, Comparison, ReplayedCommands
from space_robot_msgs_py.samples import Command, Timebase
from space_robot_msgs_py.wire.codecs import CommandCodec
from space_robot_msgs_py.wire.definitions import decode, jazzy

AXES = ("base_x", "base_y", "base_z", "joint1", "joint2")
TIMEBASE = Timebase(500_000)
TYPE = "sensor_msgs/msg/JointState"
Messages = dict[int, bytes]


def torque_of(tick: int) -> np.ndarray:
    return np.sin(tick + np.arange(5.0))


def message(tick: int, torque: np.ndarray) -> bytes:
    return CommandCodec(AXES, TIMEBASE).encode(Command(tick, torque))


def messages(ticks: Iterable[int]) -> Messages:
    return {tick: message(tick, torque_of(tick)) for tick in ticks}


def commands(data: Iterable[bytes]) -> ReplayedCommands:
    taken = CommandList(AXES, TIMEBASE)
    for sent in data:
        taken.add(sent)
    return taken.commands()


def compare(recorded: Messages, replayed: Messages, played: int) -> Comparison:
    both = (commands(sent.values()) for sent in (recorded, replayed))
    return Comparison(AXES, np.arange(played), *both, forces=AXES[3:4])


def difference(compared: Comparison) -> tuple[int, list[str]]:
    found = compared.first_difference()
    assert found is not None
    return found[0], [one.field for one in found[1]]


def foreign(data: bytes, **changes: object) -> bytes:
    read = decode(data, TYPE)
    for name, value in changes.items():
        setattr(read.header if name == "frame_id" else read, name, value)
    return bytes(jazzy().serialize_cdr(read, TYPE))


WORDS = st.integers(0, 2**64 - 1)


@given(tick=st.integers(0, 19), axis=st.integers(0, 4), one=WORDS, other=WORDS)
@example(1, 1, 0x0000000000000000, 0x8000000000000000)  # 0.0 and -0.0, equal as numbers
@example(1, 1, 0x7FF8000000000000, 0x7FF8000000000001)  # NaN, which do not equal themselves
def test_bits_are_compared_and_not_numbers(tick: int, axis: int, one: int, other: int) -> None:
    def with_bits(bits: int) -> Messages:
        torque = torque_of(tick)
        torque.view(np.uint64)[axis] = bits
        return {**messages(range(20)), tick: message(tick, torque)}

    same = compare(with_bits(one), with_bits(one), 20)
    assert same.is_identical
    assert same.first_difference() is None
    assert same.units == ("N m", "N m", "N m", "N", "N m")
    compared = compare(with_bits(one), with_bits(other), 20)
    assert compared.is_identical == (one == other)
    if one != other:
        assert np.flatnonzero(~compared.equal).tolist() == [tick]
        assert difference(compared) == (tick, [f"effort[{AXES[axis]}]"])
        (field,) = compared.report(TIMEBASE.period)["first_difference"]["fields"]
        assert str(field["recorded"]) != str(field["replayed"])  # so that one sees it


@given(recorded=st.sets(st.integers(0, 12)), replayed=st.sets(st.integers(0, 12)))
def test_every_tick_is_accounted_for(recorded: set[int], replayed: set[int]) -> None:
    compared = compare(messages(recorded), messages(replayed), 10)
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
    compared = compare(sent, {**sent, 1: foreign(sent[1], **changes)}, 3)
    assert difference(compared) == (1, fields)


def test_what_is_no_command_is_counted_and_the_first_answer_to_a_tick_counts() -> None:
    """One that was asked for again is the same, or the plant has used the first."""
    sent = messages(range(3))
    other = {**sent, 1: foreign(sent[1], name=["a", "b"], effort=np.ones(2))}  # of other axes
    compared = compare(other, sent, 3)
    assert compared.equal.tolist() == [True, False, True]
    json.dumps(compared.report(TIMEBASE.period)["axes"], allow_nan=False)
    for corrupt in (b"", sent[1][:40], sent[1][:8] + b"?" * 9):
        compared = compare({**sent, 3: corrupt}, sent, 4)
        assert not compared.is_identical
        assert compared.equal.tolist() == [True, True, True]
        report = compared.report(TIMEBASE.period)
        assert report["unreadable"] == {"recorded": 1, "replayed": 0}
    assert compare(sent, {**sent, 99: message(1, np.zeros(5))}, 3).is_identical


@given(*[st.sets(st.integers(0, 60), min_size=least) for least in (1, 0, 0)])
def test_stretches_are_runs_of_ticks(
    recorded: set[int], replayed: set[int], other: set[int]
) -> None:
    """Together they are all that was compared; none touches another."""

    def of(ticks: set[int], are_other: bool) -> ReplayedCommands:
        torque = np.array([[float(are_other and tick in other)] for tick in sorted(ticks)])
        numbers = np.array(sorted(ticks), dtype=np.int64)
        return ReplayedCommands(numbers, torque.reshape(-1, 1), {})

    compared = Comparison(("base_x",), np.arange(61), of(recorded, False), of(replayed, True))
    covered = [set(range(s.first, s.last + 1)) for s in compared.stretches]
    assert set().union(*covered) == recorded & replayed
    assert all(before.last + 1 < after.first for before, after in pairwise(compared.stretches))
    assert [s.equal for s in compared.stretches] == [len(ticks - other) for ticks in covered]
