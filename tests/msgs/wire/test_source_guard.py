"""Publishers told apart by their sequence numbers: ours is followed whatever others send."""

from __future__ import annotations

from hypothesis import assume, given
from hypothesis import strategies as st

from space_robot_msgs_py.wire.source_guard import DOUBTS, SILENCE_NS, UNSUPPORTED, SourceGuard

MS = 1_000_000


class Reader:
    """A topic's reader that knows a good message when it has looked at it."""

    def __init__(self) -> None:
        self.guard = SourceGuard()
        self.now_ns = 0
        self.used: list[str] = []

    def receive(self, sender: str, sequence: int, is_good: bool, after_ns: int = MS) -> bool:
        """Whether the message was looked at."""
        self.now_ns += after_ns
        if not self.guard.passes(sequence, self.now_ns):
            return False
        if is_good:
            self.guard.follow()
            self.used.append(sender)
        else:
            self.guard.doubt()
        return True


def test_all_messages_of_the_only_publisher_pass() -> None:
    reader = Reader()
    assert all(reader.receive("ours", k, True) for k in range(7, 60))
    assert reader.guard.others_messages == 0
    assert reader.guard.is_sure


@given(
    st.integers(1, 300), st.integers(1, 300), st.lists(st.integers(0, 6), min_size=1, max_size=150)
)
def test_a_flood_of_junk_never_takes_the_place_of_ours(
    ours: int, theirs: int, flood: list[int]
) -> None:
    """However many come between two of ours, and though their numbers overtake ours."""
    assume(theirs != ours + 1)  # see the next test
    reader = Reader()
    reader.receive("ours", ours, True)
    for k, many in enumerate(flood):
        for _ in range(many):
            reader.receive("theirs", theirs, False)
            theirs += 1
        assert reader.receive("ours", ours + 1 + k, True)
    assert reader.used == ["ours"] * (len(flood) + 1)


def test_a_flood_that_begins_with_our_next_number_is_found_out() -> None:
    reader = Reader()
    reader.receive("ours", 5, True)
    for k in range(DOUBTS):
        reader.receive("theirs", 6 + k, False)
    assert reader.receive("ours", 6, True)
    assert reader.receive("ours", 7, True)
    assert not reader.receive("theirs", 6 + DOUBTS, False)


@given(st.integers(1, 100), st.lists(st.integers(1, 10**6), max_size=40, unique=True))
def test_single_messages_of_many_others_are_refused(ours: int, others: list[int]) -> None:
    reader = Reader()
    for k in range(20):
        reader.receive("ours", ours + k, True)
    refused = [not reader.receive("theirs", number, True) for number in others]
    assert reader.guard.others_messages == sum(refused)
    assert sum(refused) >= len(others) - 1  # one may have ours' own number
    if all(refused):
        assert reader.receive("ours", ours + 20, True)


def test_a_successor_is_followed_when_ours_is_silent() -> None:
    """The publisher was restarted; its first message that makes sense counts."""
    reader = Reader()
    for k in range(1, 50):
        reader.receive("old", k, True)
    assert not reader.receive("new", 1, True)
    assert reader.receive("new", 2, False, after_ns=SILENCE_NS)
    assert reader.receive("new", 3, True)
    assert all(reader.receive("new", k, True) for k in range(4, 9))
    assert not reader.receive("other", 777, True)


def test_a_silent_publisher_that_comes_back_is_ours_still() -> None:
    """Junk in the meantime has not taken its place."""
    reader = Reader()
    for k in range(1, 5):
        reader.receive("ours", k, True)
    for k in range(90, 93):
        assert reader.receive("theirs", k, False, after_ns=SILENCE_NS + MS)
    assert reader.receive("ours", 5, True)
    assert reader.guard.is_sure
    assert not reader.receive("theirs", 93, False)


def test_after_a_gap_ours_is_found_again() -> None:
    """Its queue has overflown: within the silence it passes again."""
    reader = Reader()
    for k in range(1, 5):
        reader.receive("ours", k, True)
    passed = [reader.receive("ours", 100 + k, True, after_ns=100 * MS) for k in range(12)]
    assert passed == sorted(passed)
    assert passed[SILENCE_NS // (100 * MS)]


def test_behind_a_gap_the_only_publisher_is_found_again_at_once() -> None:
    """With a second one it could be that one's."""
    guard = SourceGuard()
    assert guard.passes(4, MS)
    guard.follow()
    assert not guard.passes(7, MS, lambda: False)
    assert guard.passes(8, MS, lambda: True)
    assert not guard.is_sure
    guard.follow()
    assert guard.passes(9, MS)
    assert guard.others_messages == 1


@given(st.integers(1, 50), st.integers(0, 50), st.integers(0, 50))
def test_one_found_by_a_message_put_aside_is_followed_behind_all_that_has_passed(
    first: int, before: int, behind: int
) -> None:
    """As when messages of a sender not yet known are looked through for one that fits."""
    guard, passed = SourceGuard(), []
    for sequence in range(first, first + before + 1 + behind):
        assert guard.passes(sequence, MS)
        passed.append(guard.passed)
    guard.passed = passed[before]
    guard.follow()
    assert all(guard.has_sent(sequence) for sequence, _ in passed)
    following = passed[-1][0] + 1
    assert not guard.has_sent(following)
    assert guard.passes(following, 2 * MS)
    assert guard.is_sure
    assert guard.others_messages == 0


def test_a_publisher_of_nothing_but_junk_is_not_followed_for_long() -> None:
    """Followed for one good message, or by mistake."""
    reader = Reader()
    reader.receive("theirs", 10, True)
    for k in range(DOUBTS):
        assert not reader.receive("ours", 500 + k, True)
        reader.receive("theirs", 11 + k, False)
    assert reader.receive("ours", 600, True)
    assert not reader.receive("theirs", 11 + DOUBTS, False)


def test_now_and_then_a_bad_message_changes_nothing() -> None:
    reader = Reader()
    for k in range(1, 200):
        assert reader.receive("ours", k, is_good=k % DOUBTS == 1)
        assert not reader.receive("theirs", 5000 + k, True) or k == 1


def test_a_middleware_that_counts_nothing_lets_all_pass() -> None:
    reader = Reader()
    assert all(reader.receive("any", UNSUPPORTED, True) for _ in range(20))
    assert reader.guard.others_messages == 0
