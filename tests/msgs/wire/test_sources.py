"""What is counted and believed of received messages: lost ones, and strange stamps."""

from __future__ import annotations

import random
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.accounts import foreign, noted_accounts
from space_robot_msgs_py.bag.metadata import read_information
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import Command, Timebase
from space_robot_msgs_py.wire.codecs import CommandCodec
from space_robot_msgs_py.wire.sources import PARTICIPANT_BYTES, Claimed, Sources
from space_robot_msgs_py.wire.stamp_guard import AGREEING, StampGuard

TIMEBASE = Timebase(500_000)
TOPIC = topics.COMMAND.full_name
OURS, FOREIGN = b"1" * 16, b"2" * 16


class Graph:
    """What discovery and claims say: one publisher is ours."""

    def claimed(self, topic: str) -> Claimed:
        return Claimed((OURS,), True)

    def names(self, topic: str) -> Mapping[bytes, str]:
        return {}


@given(
    st.integers(0, 40), st.integers(0, 40), st.sets(st.integers(1, 40)), st.randoms(), st.booleans()
)
def test_lost_is_what_was_sent_and_did_not_come(
    ours: int, foreign: int, dropped: set[int], order: random.Random, is_told: bool
) -> None:
    """Against two lists, however the publishers' messages are interleaved."""
    sources, left = Sources(TOPIC, Graph()), {OURS: ours, FOREIGN: foreign}
    sent: dict[bytes, list[int]] = {OURS: [], FOREIGN: []}
    came: list[int] = []
    while any(left.values()):
        publisher = order.choice([p for p, count in left.items() if count])
        left[publisher] -= 1
        sent[publisher].append(len(sent[publisher]) + 1)
        if sent[publisher][-1] not in dropped:
            is_ours = sources.take(publisher, sent[publisher][-1])
            assert is_ours == (publisher == OURS)
            came += [sent[publisher][-1]] * is_ours
    if is_told:
        sources.note_sent(OURS[:PARTICIPANT_BYTES], len(sent[OURS]))
    known = sent[OURS] if is_told else sent[OURS][: max(came, default=0)]
    assert sources.holes + sources.tail == len(set(known) - set(came))
    assert sources.foreign == len(set(sent[FOREIGN]) - dropped)
    assert sources.is_behind == (is_told and len(sent[OURS]) > max(came, default=0))


def command(tick: int) -> bytes:
    return CommandCodec(("j",), TIMEBASE).encode(Command(tick, np.ones(1)))


@pytest.mark.parametrize(
    ("sent", "lost"),
    [
        ([(1, 0), (2, 1), (3, 500), (5, 502)], 1),  # unanswered ticks are none
        ([(3, 0), (4, 1), (6, 3), (7, 2), (8, 2)], 0),  # sent again: 1 and 2 were tick 0, too
    ],
)
def test_lost_is_told_by_the_numbers_of_the_messages(
    tmp_path: Path, sent: list[tuple[int, int]], lost: int
) -> None:
    recorder = BagRecorder(tmp_path / "bag", {}, TIMEBASE, publishers=Graph())
    for sequence, tick in sent:
        for junk in (command(tick), b"junk"):
            assert not recorder.record(topics.COMMAND, junk, 1, FOREIGN, 2 * sequence)
        assert recorder.record(topics.COMMAND, command(tick), 1, OURS, sequence)
    assert recorder.lost[TOPIC] == lost
    recorder.note_sent(TOPIC, OURS, sent[-1][0] + 2)
    assert recorder.is_behind
    assert recorder.lost[TOPIC] == lost + 2
    recorder.close()
    accounts = noted_accounts(read_information(tmp_path / "bag").noted)
    assert (accounts[TOPIC].missing, accounts[TOPIC].foreign) == (lost + 2, 2 * len(sent))
    for text in ("[", "[]", '{"/a": null}', '{"/a": {"received": -1, "missing": 0}}', "NaN"):
        assert noted_accounts({"space_robot.accounting": text}) == {}
    assert noted_accounts({}) == {}
    told = '{"/command": {"received": 3, "missing": 0, "foreign": 2, "foreign_publishers": ["/a"]}}'
    said = "2 messages on /command were left out: they are from /a"
    assert foreign(noted_accounts({"space_robot.accounting": told})) == [said]


JUMP = 8

steps = st.lists(st.integers(1, JUMP), max_size=30)
stamps = st.lists(st.integers(0, 40) | st.integers(0, 10**9), max_size=40)


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


@given(stamps)
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


@given(stamps, st.integers(0, 10**9), steps)
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
