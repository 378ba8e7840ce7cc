"""Guard against strange stamps."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py.wire.stamp_guard import AGREEING, StampGuard

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
