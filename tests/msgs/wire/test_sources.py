"""Publishers told apart: the graph's own counted to the last message, foreign ones left out."""

from __future__ import annotations

import random
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from bags import read_accounts
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.accounts import foreign, noted_accounts
from space_robot_msgs_py.bag.mcap_storage import McapStorage
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.bag.rows import stamps_of
from space_robot_msgs_py.samples import Command, Timebase
from space_robot_msgs_py.wire.codecs import CommandCodec
from space_robot_msgs_py.wire.sources import PARTICIPANT_BYTES, Claimed, Sources

TIMEBASE = Timebase(500_000)
TOPIC = topics.COMMAND.full_name
OURS, AGAIN, FOREIGN, OTHER = (bytes([number] * 16) for number in range(1, 5))


class Graph:
    """What discovery and claims say, as the test sets it."""

    def __init__(self) -> None:
        self.claim = Claimed((OURS,), True)
        self.listed: dict[bytes, str] = {}

    def claimed(self, topic: str) -> Claimed:
        return self.claim

    def names(self, topic: str) -> Mapping[bytes, str]:
        return self.listed


@pytest.fixture
def graph() -> Graph:
    return Graph()


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


@pytest.mark.parametrize("order", [(FOREIGN, OURS), (OURS, FOREIGN)])
def test_the_claim_decides_whoever_comes_first(graph: Graph, order: tuple[bytes, ...]) -> None:
    sources = Sources(TOPIC, graph)
    assert [sources.take(p, 1) for p in order] == [p == OURS for p in order]


def test_a_node_that_was_started_again_is_ours(graph: Graph) -> None:
    sources = Sources(TOPIC, graph)
    assert sources.take(OURS, 1)
    graph.claim = Claimed((OURS,), False)  # killed
    assert not sources.take(FOREIGN, 1)
    graph.claim = Claimed((AGAIN,), True)
    assert sources.take(AGAIN, 3)
    assert sources.take(OURS, 2)  # was on its way
    assert not sources.take(OTHER, 1)
    assert (sources.holes, sources.foreign) == (2, 2)


def test_one_that_had_ended_before_it_was_heard_is_ours(graph: Graph) -> None:
    """The recorder was behind: the topic has been claimed anew before its first message came."""
    graph.claim = Claimed((OURS, AGAIN), True)
    sources = Sources(TOPIC, graph)
    assert sources.take(OURS, 1)
    assert sources.take(AGAIN, 1)
    assert not sources.take(FOREIGN, 1)
    assert sources.foreign == 1


def test_a_topic_that_nobody_claims_is_its_first_publishers(graph: Graph) -> None:
    graph.claim = Claimed()
    graph.listed = {OURS: "/player", FOREIGN: "/other", AGAIN: "/player", OTHER: ""}
    sources = Sources(TOPIC, graph)
    assert [sources.take(p, 1) for p in (OURS, FOREIGN, AGAIN, OTHER)] == [True, False, True, False]
    del graph.listed[OURS], graph.listed[AGAIN]
    assert sources.take(bytes(16), 1)  # those are gone: it takes their place


def test_who_claims_it_takes_a_topic_over(graph: Graph) -> None:
    graph.claim = Claimed()
    sources = Sources(TOPIC, graph)
    assert sources.take(FOREIGN, 1)
    assert not sources.begins_anew
    graph.claim = Claimed((OURS,), True)
    assert sources.take(OURS, 1)
    assert sources.begins_anew
    assert not sources.take(FOREIGN, 2)
    assert (sources.holes, sources.foreign) == (0, 2)


def test_what_is_sent_in_a_pause_is_passed_over(graph: Graph) -> None:
    sources = Sources(TOPIC, graph)
    for sequence in (1, 2, 4):
        sources.take(OURS, sequence)
    sources.pause()
    sources.note_sent(OURS[:PARTICIPANT_BYTES], 9)
    assert (sources.holes, sources.is_behind) == (1, False)
    for sequence in (11, 12, 14):
        sources.take(OURS, sequence)
    assert (sources.holes, sources.passed_over) == (2, 6)


@given(st.integers(0, 5), st.booleans(), st.integers(1, 20), st.integers(1, 20))
def test_who_is_first_heard_after_a_pause_has_lost_nothing(
    before: int, pauses: bool, first: int, after: int
) -> None:
    """What it sent until then was not to be recorded; without a pause it is lost."""
    graph = Graph()
    graph.claim = Claimed((OURS, AGAIN), True)
    sources = Sources(TOPIC, graph)
    for sequence in range(1, before + 1):
        sources.take(OURS, sequence)
    if pauses:
        sources.pause()
    for sequence in range(first, first + after):
        assert sources.take(AGAIN, sequence)
    passed = first - 1
    assert (sources.holes, sources.passed_over) == ((0, passed) if pauses else (passed, 0))
    assert sources.take(AGAIN, first + after + 2)
    assert sources.holes == (2 if pauses else passed + 2)


def test_nothing_has_come_of_what_was_told(graph: Graph) -> None:
    sources = Sources(TOPIC, graph)
    sources.note_sent(FOREIGN[:PARTICIPANT_BYTES], 1000)
    assert (sources.tail, sources.is_behind) == (0, False)
    sources.note_sent(OURS[:PARTICIPANT_BYTES], 7)
    assert (sources.tail, sources.is_behind) == (7, True)


def test_foreign_publishers_are_named_when_their_names_are_known(graph: Graph) -> None:
    sources = Sources(TOPIC, graph)
    for publisher in (OURS, FOREIGN, OTHER):
        sources.take(publisher, 1)
    sources.find_names()
    assert sources.foreign_names == ["2 publishers without a name"]
    graph.listed = {OURS: "/controller_node", FOREIGN: "/rogue"}
    sources.find_names()
    assert sources.foreign_names == ["/rogue", "1 publisher without a name"]


def _command(tick: int, torque: float) -> bytes:
    return CommandCodec(("j",), TIMEBASE).encode(Command(tick, np.array([torque])))


@pytest.mark.parametrize("stamps", [range(10), range(5, 15), range(10**6, 10**6 + 10)])
def test_foreign_messages_displace_nothing(tmp_path: Path, graph: Graph, stamps: range) -> None:
    """With the stamps of ours, later ones, or of another time; or malformed."""
    recorder = BagRecorder(tmp_path / "bag", {}, TIMEBASE, publishers=graph)
    for tick, stamp in enumerate(stamps):
        assert not recorder.record(topics.COMMAND, _command(stamp, 9.0), 1, FOREIGN, 2 * tick + 1)
        assert not recorder.record(topics.COMMAND, b"junk", 1, FOREIGN, 2 * tick + 2)
        assert recorder.record(topics.COMMAND, _command(tick, 1.0), 1, OURS, tick + 1)
    recorder.close()
    counts = read_accounts(tmp_path / "bag")[TOPIC]
    assert (counts["received"], counts["missing"], counts["invalid_stamps"]) == (10, 0, 0)
    assert (counts["foreign"], counts["repeated"]) == (20, 0)
    (batch,) = McapStorage(tmp_path / "bag" / "bag_0.mcap").batches()
    assert stamps_of(batch).tolist() == [TIMEBASE.stamp_ns(tick) for tick in range(10)]
    assert all(batch.message(i) == _command(i, 1.0) for i in range(10))


def test_unanswered_ticks_are_not_lost_and_lost_answers_are(tmp_path: Path, graph: Graph) -> None:
    recorder = BagRecorder(tmp_path / "bag", {}, TIMEBASE, publishers=graph)
    answers = [(1, 0), (2, 1), (3, 500), (5, 502)]  # sequence number, tick
    for sequence, tick in answers:
        recorder.record(topics.COMMAND, _command(tick, 1.0), 1, OURS, sequence)
    assert recorder.lost[TOPIC] == 1
    recorder.close()


def test_what_was_lost_and_sent_again_is_not_lost(tmp_path: Path, graph: Graph) -> None:
    recorder = BagRecorder(tmp_path / "bag", {}, TIMEBASE, publishers=graph)
    for sequence, tick in [(3, 0), (4, 1), (6, 3), (7, 2), (8, 2)]:  # 1 and 2 were tick 0, too
        recorder.record(topics.COMMAND, _command(tick, 1.0), 1, OURS, sequence)
    assert recorder.lost[TOPIC] == 0
    recorder.note_sent(TOPIC, OURS, 10)
    assert recorder.is_behind
    assert recorder.lost[TOPIC] == 2
    recorder.close()


def test_what_the_recorder_noted_is_read_back_with_care() -> None:
    whole = (
        '{"/command": {"received": 3, "missing": 0, "foreign": 2, "foreign_publishers": ["/a"]}}'
    )
    accounts = noted_accounts({"space_robot.accounting": whole})
    assert foreign(accounts) == ["2 messages on /command were left out: they are from /a"]
    for text in ("[", "[]", '{"/a": null}', '{"/a": {"received": -1, "missing": 0}}', "NaN"):
        assert noted_accounts({"space_robot.accounting": text}) == {}
    assert noted_accounts({}) == {}


def test_where_messages_tell_no_publisher_all_are_ours(tmp_path: Path) -> None:
    """What was lost cannot be known then from their numbers."""
    recorder = BagRecorder(tmp_path / "bag", {}, TIMEBASE)
    numbers = (1, 2, 500, 3, 501)
    kept = [
        recorder.record(topics.COMMAND, _command(tick, 1.0), 1_000_000, b"", number)
        for tick, number in enumerate(numbers)
    ]
    recorder.note_sent(TOPIC, b"", 3)
    assert kept == [True] * 5
    assert not recorder.foreign
    assert not recorder.is_behind
    assert recorder.lost[TOPIC] == 0
    recorder.close()
    assert read_accounts(tmp_path / "bag")[TOPIC]["received"] == 5
