"""Counting many messages at once is counting each of them."""

from __future__ import annotations

import itertools
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import read_information
from space_robot_msgs_py.bag.message_accounting import (
    LONGEST_JUMP,
    MessageAccounting,
    SequenceCount,
    noted_accounts,
)
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import Command, Timebase
from space_robot_msgs_py.wire.codecs import CommandCodec

steps = st.sampled_from([1, 1, 1, 1, 2, 5, 0, -1, -3, 19_999, 20_001, 10**12])
batches = st.lists(st.lists(steps, max_size=12), max_size=6)


@pytest.mark.parametrize("topic", [topics.JOINT_STATES, topics.CLOCK, topics.LAW])
@given(st.integers(-5, 100_000), batches)
def test_a_batch_counts_as_its_messages_one_by_one(
    topic: topics.Topic, first: int, given_steps: list[list[int]]
) -> None:
    at_once, singly, tick = MessageAccounting(topic), MessageAccounting(topic), first
    for batch in given_steps:
        ticks = tick + np.cumsum([0, *batch], dtype=np.int64)[:-1]
        tick += sum(batch)
        assert at_once.take_all(ticks).tolist() == [singly.take(int(k)) for k in ticks]
    for field in fields(MessageAccounting):
        if field.name != "_guard":
            assert getattr(at_once, field.name) == getattr(singly, field.name), field.name


def test_events_may_come_whenever_they_like() -> None:
    """Two of one tick are two, a long silence is no strange stamp, none at all is no loss."""
    counted = MessageAccounting(topics.LAW)
    assert counted.missing(1000) == 0
    for tick in (0, 7, 7, 3 * LONGEST_JUMP, 9):
        assert counted.take(tick)
    assert (counted.received, counted.repeated, counted.invalid_stamps) == (5, 0, 0)
    assert counted.missing(4 * LONGEST_JUMP) == 0


@pytest.mark.parametrize("topic", [topics.JOINT_STATES, topics.COMMAND], ids=lambda t: t.full_name)
@given(st.lists(st.integers(0, 60), max_size=80), st.integers(0, 5))
def test_ticks_are_counted_as_a_set_has_them(
    topic: topics.Topic, ticks: list[int], more: int
) -> None:
    """Late, twice, late and twice, in any order: against sets, which know nothing of holes."""
    counted, came = MessageAccounting(topic), set[int]()
    for tick in ticks:
        assert counted.take(tick) == (tick not in came)
        came.add(tick)
    last = max(came, default=-1)
    assert counted.received == len(came)
    assert counted.repeated == len(ticks) - len(came)
    assert counted.invalid_stamps == 0
    assert counted.last == last
    assert counted.missing(last + more) == len(set(range(last + more + 1)) - came)


@given(st.integers(1, 30), st.sets(st.integers(0, 40), min_size=1))
def test_messages_at_a_period_are_counted_as_a_set_has_them(period: int, places: set[int]) -> None:
    """Of a topic with a message every few ticks, the smallest step seen is its period."""
    counted, sent = MessageAccounting(topics.CLOCK), sorted(places)
    for place in sent:
        counted.take(period * place)
    smallest = min((b - a for a, b in itertools.pairwise(sent)), default=1)
    expected = set(range(sent[0], sent[-1] + 1, smallest))
    assert counted.missing(period * 41) == max(0, len(expected) - len(sent))
    assert counted.received == len(sent)


@given(st.integers(2, 30), st.integers(2, 12), st.integers(2, 5), st.integers(1, 9))
def test_a_stream_said_again_from_its_start_is_whole(
    period: int, start: int, ahead: int, more: int
) -> None:
    """Who joins late hears the end of what was sent before, and then all of it once more."""
    counted = MessageAccounting(topics.REFERENCE_JOINTS)
    before = range(start, start + ahead)
    again = range(start + ahead + more)
    for place in before:
        assert counted.take(period * place)
    for place in again:
        assert counted.take(period * place) == (place not in before)
    assert (counted.received, counted.repeated) == (len(again), ahead)
    assert counted.missing(period * 100) == counted.gaps == 0


@pytest.mark.parametrize("topic", [topics.JOINT_STATES, topics.CLOCK], ids=lambda t: t.full_name)
@given(st.integers(1, 30), st.integers(0, 12), st.integers(0, 100), st.integers(2, 12))
def test_what_a_pause_passed_over_is_no_gap(
    topic: topics.Topic, period: int, before: int, passed: int, after: int
) -> None:
    counted, period = MessageAccounting(topic), 1 if topic.per_tick else period
    places = [*range(before), *range(before + passed, before + passed + after)]
    for i, place in enumerate(places):
        if i == before:
            counted.pause()
        assert counted.take(period * place)
    assert counted.gaps == 0
    lost = counted.last + 3 * period
    assert counted.take(lost)
    assert counted.gaps == 2


@given(st.integers(1, 30), st.permutations(range(6)), st.integers(0, 5))
def test_late_messages_count_for_the_period_too(period: int, order: list[int], start: int) -> None:
    """In any order all are there, from wherever the topic began."""
    counted = MessageAccounting(topics.CLOCK)
    for place in order:
        assert counted.take(period * (start + place))
    assert counted.unit == period
    assert counted.received == 6
    assert counted.missing(10**6) == 0
    assert (counted.first, counted.last) == (period * start, period * (start + 5))


# By the publisher's own numbers


@given(
    st.lists(st.tuples(st.integers(1, 30), st.sets(st.integers(1, 30)), st.booleans()), min_size=1)
)
def test_lost_is_what_was_sent_and_did_not_come(
    publishers: list[tuple[int, set[int], bool]],
) -> None:
    """Of a node and those started again in its place, which may report what they sent."""
    counted, lost, last = SequenceCount(), 0, 0
    for sent, dropped, reports in publishers:
        came = sorted(set(range(1, sent + 1)) - dropped)
        if not came or came[0] > last > 0:
            continue  # not to be told from the one before
        last = came[-1]
        for number in came:
            counted.take(number)
        if reports:
            counted.note_sent(sent)
        lost += (sent if reports else last) - len(came)
        assert counted.is_counted
        assert counted.holes + counted.tail == lost
        assert counted.awaited == (sent - last if reports else 0)


def test_what_was_sent_in_a_pause_is_passed_over() -> None:
    counted = SequenceCount()
    counted.take(1)
    counted.pause()
    counted.note_sent(5)
    assert counted.tail == counted.awaited == 0
    counted.take(9)
    counted.take(0)  # not known
    assert (counted.passed_over, counted.holes, counted.tail) == (7, 0, 0)
    counted.note_sent(10)
    assert counted.tail == 1


@pytest.mark.parametrize(
    ("sent", "lost"),
    [
        ([(1, 0), (2, 1), (3, 500), (5, 502)], 1),  # unanswered ticks are none
        ([(3, 0), (4, 1), (6, 3), (7, 2), (8, 2)], 0),  # sent again: 1 and 2 were tick 0, too
    ],
)
def test_the_recorder_believes_the_numbers_of_the_messages(
    tmp_path: Path, sent: list[tuple[int, int]], lost: int
) -> None:
    topic, timebase = topics.COMMAND, Timebase(500_000)
    recorder = BagRecorder(tmp_path / "bag", {}, timebase)
    for sequence, tick in sent:
        data = CommandCodec(("j",), timebase).encode(Command(tick, np.ones(1)))
        recorder.record(topic, data, 1, sequence)
    assert recorder.lost[topic.full_name] == lost
    recorder.note_sent(topic.full_name, sent[-1][0] + 2)
    assert recorder.is_behind
    recorder.close()
    accounts = noted_accounts(read_information(tmp_path / "bag").noted)
    assert accounts[topic.full_name].missing == lost + 2


@pytest.mark.parametrize(
    "text", ["[", "[]", '{"/a": null}', '{"/a": {"received": -1, "missing": 0}}', "NaN"]
)
def test_accounts_of_anything_else_are_none(text: str) -> None:
    assert noted_accounts({"space_robot.accounting": text}) == noted_accounts({}) == {}
