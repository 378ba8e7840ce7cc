"""Commands of a replay beside the recorded ones: what is equal, what differs, what is missing."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot.flight.replay.commands import CommandList, Form, ReplayedCommands
from space_robot.flight.replay.comparison import Comparison
from space_robot_msgs_py.samples import Command, Timebase
from space_robot_msgs_py.wire.codecs import CommandCodec
from space_robot_msgs_py.wire.definitions import decode, jazzy

AXES = ("base_x", "base_y", "base_z", "joint1", "joint2")
TIMEBASE = Timebase(500_000)
TYPE = "sensor_msgs/msg/JointState"


def torque_of(tick: int) -> np.ndarray:
    return np.sin(tick + np.arange(5.0))


def messages(ticks: Iterable[int]) -> dict[int, bytes]:
    codec = CommandCodec(AXES, TIMEBASE)
    return {tick: codec.encode(Command(tick, torque_of(tick))) for tick in ticks}


def commands(data: Iterable[bytes]) -> ReplayedCommands:
    taken = CommandList(AXES, TIMEBASE)
    for message in data:
        taken.add(message)
    return taken.commands()


def compare(recorded: Iterable[bytes], replayed: Iterable[bytes], played: int) -> Comparison:
    return Comparison(AXES, np.arange(played), commands(recorded), commands(replayed))


@given(tick=st.integers(0, 19), axis=st.integers(0, 4), bit=st.integers(0, 63))
def test_one_bit_is_found_where_it_was_changed(tick: int, axis: int, bit: int) -> None:
    """Whatever bit: of the mantissa's end, of the sign of zero, or one that makes it a NaN."""
    sent = messages(range(20))
    torque = torque_of(tick)
    torque.view(np.uint64)[axis] ^= np.uint64(1 << bit)
    changed = {**sent, tick: CommandCodec(AXES, TIMEBASE).encode(Command(tick, torque))}
    assert compare(sent.values(), sent.values(), 20).is_identical
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


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (0x0000000000000000, 0x8000000000000000),  # 0.0 and -0.0, which are equal as numbers
        (0x7FF8000000000000, 0xFFF8000000000000),  # NaN and -NaN, which are not, nor each itself
        (0x7FF8000000000000, 0x7FF8000000000001),  # NaN of another payload
        (0x0000000000000001, 0x0000000000000000),  # the smallest number there is
        (0x7FF0000000000000, 0xFFF0000000000000),
    ],
)
@pytest.mark.parametrize("field", ["effort", "position", "velocity"])
def test_bits_are_compared_and_not_numbers(one: int, other: int, field: str) -> None:
    """In the torques and in the fields that a command of others may have."""
    sent = messages(range(3))

    def with_bits(bits: int) -> dict[int, bytes]:
        if field == "effort":
            torque = torque_of(1)
            torque.view(np.uint64)[2] = bits
            return {**sent, 1: CommandCodec(AXES, TIMEBASE).encode(Command(1, torque))}
        values = np.array([0, bits], np.uint64).view(np.float64)
        return {**sent, 1: foreign(sent[1], **{field: values})}

    for bits in (one, other):  # each is equal to itself, NaN too
        same = compare(with_bits(bits).values(), with_bits(bits).values(), 3)
        assert same.is_identical
        assert same.report(TIMEBASE.period)["equal"] == 3
    compared = compare(with_bits(one).values(), with_bits(other).values(), 3)
    assert not compared.is_identical
    assert compared.equal.tolist() == [True, False, True]
    found = compared.first_difference()
    assert found is not None
    (difference,) = found[1]
    assert difference.field.startswith(field)
    assert str(difference.recorded) != str(difference.replayed)  # so that one sees it


def test_every_command_may_be_of_another_form() -> None:
    """More of them than 16 bits can number."""
    taken = CommandList(AXES, TIMEBASE)
    taken._forms.update({Form(f"seen {k}", ""): k for k in range(1, 70_000)})
    sent = messages(range(2))
    for message in (sent[0], foreign(sent[1], frame_id="new")):
        taken.add(message)
    commands = taken.commands()
    assert [commands.forms[form].frame_id for form in commands.form] == ["base_link", "new"]


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


@pytest.mark.parametrize("corrupt", [lambda m: b"", lambda m: m[:40], lambda m: m[:8] + b"?" * 9])
def test_what_is_no_command_is_counted(corrupt: Callable[[bytes], bytes]) -> None:
    sent = messages(range(4))
    compared = compare({**sent, 3: corrupt(sent[3])}.values(), messages(range(3)).values(), 4)
    assert not compared.is_identical
    assert compared.equal.tolist() == [True, True, True]
    report = compared.report(TIMEBASE.period)
    assert report["unreadable"] == {"recorded": 1, "replayed": 0}


def test_the_first_answer_to_a_tick_counts() -> None:
    """One that was asked for again is the same, or the plant has used the first."""
    sent = messages(range(3))
    again = CommandCodec(AXES, TIMEBASE).encode(Command(1, np.zeros(5)))
    assert compare(sent.values(), [*sent.values(), again], 3).is_identical


def test_commands_of_bags_up_to_release_0_7_are_compared_by_their_numbers() -> None:
    """Their frame was called otherwise, in all of them or in those before an update."""
    sent = messages(range(20))
    former = {tick: foreign(data, frame_id="base") for tick, data in sent.items()}
    assert compare(former.values(), sent.values(), 20).is_identical
    mixed = {**former, 7: sent[7]}
    assert compare(mixed.values(), sent.values(), 20).is_identical
    torque = torque_of(5)
    torque[2] = -torque[2]
    changed = CommandCodec(AXES, TIMEBASE).encode(Command(5, torque))
    other = {**former, 5: foreign(changed, frame_id="base")}
    compared = compare(other.values(), sent.values(), 20)
    assert compared.ticks[~compared.equal].tolist() == [5]
    found = compared.first_difference()
    assert found is not None
    assert [difference.field for difference in found[1]] == ["effort[base_z]"]


@given(
    st.sets(st.integers(0, 60), min_size=1),
    st.sets(st.integers(0, 60)),
    st.sets(st.integers(0, 60)),
)
def test_stretches_are_runs_of_ticks(
    recorded: set[int], replayed: set[int], other: set[int]
) -> None:
    """Together they are all that was compared; none touches another."""

    def commands(ticks: set[int], are_other: bool) -> ReplayedCommands:
        torque = np.array([[float(are_other and tick in other)] for tick in sorted(ticks)])
        return ReplayedCommands(
            np.array(sorted(ticks), dtype=np.int64),
            torque.reshape(-1, 1),
            np.zeros(len(ticks), dtype=np.intp),
            [Form("", "")],
            0,
        )

    compared = Comparison(
        ("base_x",), np.arange(61), commands(recorded, False), commands(replayed, True)
    )
    covered = [set(range(s.first, s.last + 1)) for s in compared.stretches]
    assert set().union(*covered) == recorded & replayed
    assert all(before.last + 1 < after.first for before, after in pairwise(compared.stretches))
    assert [s.equal for s in compared.stretches] == [len(ticks - other) for ticks in covered]
