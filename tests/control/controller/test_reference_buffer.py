"""The ring of reference rows: whatever order they come in, the right row at its tick."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_control.controller.reference_buffer import (
    MOST_PUT_ASIDE,
    PAST_SHARE,
    ReferenceBuffer,
)
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import Reference, ReferenceChunk

CAPACITY = 32


def chunk(start: int, length: int, n: int = 2, version: float = 0.0) -> ReferenceChunk:
    """Rows that tell their tick."""
    ticks = np.arange(start, start + length, dtype=float)
    joints = ticks[:, None, None] + np.array([0.0, 0.1, 0.2])[:, None] + np.arange(n) * 1e-3
    return ReferenceChunk(start, joints + version, np.tile(ticks[:, None], 10) + 0.5 + version)


def assert_holds(buffer: ReferenceBuffer, tick: int) -> None:
    expected = chunk(tick, 1)
    assert buffer.covers(tick)
    np.testing.assert_array_equal(buffer.at(tick), expected.references())


def test_new_buffer_covers_nothing() -> None:
    buffer = ReferenceBuffer(2, CAPACITY)
    assert not any(buffer.covers(tick) for tick in range(3 * CAPACITY))


def test_new_buffer_does_not_cover_tick_minus_one() -> None:
    assert not ReferenceBuffer(2, CAPACITY).covers(-1)


def test_rows_are_found_at_their_ticks() -> None:
    buffer = ReferenceBuffer(3, CAPACITY)
    buffer.add(chunk(100, 10, n=3))
    for tick in range(100, 110):
        np.testing.assert_array_equal(buffer.at(tick), chunk(tick, 1, n=3).references())
    assert not buffer.covers(99)
    assert not buffer.covers(110)
    assert not buffer.covers(100 + CAPACITY)
    assert not buffer.covers(100 - CAPACITY)


def test_a_tick_is_covered_when_both_parts_are_there() -> None:
    """They come as two messages."""
    for first, second in (("add_joints", "add_base"), ("add_base", "add_joints")):
        buffer, whole = ReferenceBuffer(2, CAPACITY), chunk(5, 4)
        rows = {"add_joints": whole.joints, "add_base": whole.base}
        getattr(buffer, first)(5, rows[first])
        assert not buffer.covers(6)
        getattr(buffer, second)(5, rows[second][:2])
        assert_holds(buffer, 6)
        assert not buffer.covers(7)


def test_ring_forgets_a_row_when_a_newer_one_needs_its_place() -> None:
    buffer = ReferenceBuffer(2, CAPACITY)
    for start in range(0, 10 * CAPACITY, 5):
        buffer.add(chunk(start, 5))
    newest = 10 * CAPACITY + 4 - (10 * CAPACITY - 1) % 5
    held = [tick for tick in range(newest + 2 * CAPACITY) if buffer.covers(tick)]
    assert len(held) == CAPACITY
    assert held == list(range(held[0], held[0] + CAPACITY))
    for tick in held:
        assert_holds(buffer, tick)


def test_a_repeated_old_chunk_does_not_push_out_a_newer_one() -> None:
    """Transient-local topics repeat the past to late joiners."""
    buffer, old = ReferenceBuffer(2, CAPACITY), chunk(0, 8)
    buffer.add(old)
    buffer.add(chunk(CAPACITY, 4))
    buffer.add(old)
    for tick in (CAPACITY, CAPACITY + 3, 4, 7):
        assert_holds(buffer, tick)
    assert not buffer.covers(0)
    assert not buffer.covers(3)


def test_a_tick_sent_again_is_overwritten() -> None:
    """A changed plan: the last word counts."""
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.add(chunk(0, 8, version=1000.0))
    buffer.add(chunk(4, 4))
    assert_holds(buffer, 4)
    assert buffer.at(3)[0].quaternion[0] == 1003.5


def test_a_chunk_longer_than_the_ring_leaves_its_end() -> None:
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.add(chunk(10, 3 * CAPACITY))
    stop = 10 + 3 * CAPACITY
    assert not buffer.covers(stop - CAPACITY - 1)
    for tick in range(stop - CAPACITY, stop):
        assert_holds(buffer, tick)


def test_an_empty_chunk_changes_nothing() -> None:
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.add(chunk(3, 0))
    assert not buffer.covers(3)


@given(st.permutations(range(0, CAPACITY, 4)), st.integers(0, 10**6))
def test_order_of_arrival_does_not_matter_within_the_ring(order: list[int], begin: int) -> None:
    """Also wherever the ring's seam lies."""
    buffer = ReferenceBuffer(2, CAPACITY)
    for offset in order:
        buffer.add(chunk(begin + offset, 4))
    for tick in range(begin, begin + CAPACITY):
        assert_holds(buffer, tick)
    assert not buffer.covers(begin + CAPACITY)


@given(st.lists(st.tuples(st.integers(0, 5 * CAPACITY), st.integers(1, 2 * CAPACITY)), max_size=12))
def test_what_is_covered_is_always_right_and_the_newest_always_covered(
    arrivals: list[tuple[int, int]],
) -> None:
    """Any sequence of chunks: place i holds the newest tick that fell on it."""
    buffer, newest = ReferenceBuffer(2, CAPACITY), {}
    for start, length in arrivals:
        buffer.add(chunk(start, length))
        for tick in range(start, start + length):
            newest[tick % CAPACITY] = max(tick, newest.get(tick % CAPACITY, 0))
    for tick in range(8 * CAPACITY):
        assert buffer.covers(tick) == (newest.get(tick % CAPACITY) == tick)
        if buffer.covers(tick):
            assert_holds(buffer, tick)


# Once it is known what is now


@given(
    st.integers(0, 10**6),
    st.lists(st.tuples(st.integers(-3 * CAPACITY, 3 * CAPACITY), st.integers(1, 8)), max_size=12),
)
def test_rows_around_now_are_kept_whatever_comes_from_elsewhere_in_time(
    now: int, others: list[tuple[int, int]]
) -> None:
    """Far ahead or long past, they take no place that is needed."""
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.begin(now)
    first = now - CAPACITY // PAST_SHARE
    buffer.add(chunk(now, 8))
    for offset, length in others:
        buffer.add(chunk(now + offset, length))
    for tick in range(now, now + 8):
        assert_holds(buffer, tick)
    for tick in range(now - 4 * CAPACITY, now + 4 * CAPACITY):
        if buffer.covers(tick):
            assert first <= tick < first + CAPACITY
            assert_holds(buffer, tick)


@given(st.integers(4 * CAPACITY, 10**6), st.integers(0, 2 * CAPACITY))
def test_a_new_time_finds_the_rows_that_came_before_it_was_known(old: int, new: int) -> None:
    """A mission that follows a new plant is faster than the states."""
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.begin(old)
    buffer.add(chunk(old, 4))
    buffer.add(chunk(new, 4))
    assert not buffer.covers(new)
    buffer.begin(new)
    for tick in range(new, new + 4):
        assert_holds(buffer, tick)
    buffer.add(chunk(new + 4, 4))
    assert_holds(buffer, new + 5)


def test_what_is_put_aside_is_bounded() -> None:
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.begin(10 * CAPACITY)
    for start in range(MOST_PUT_ASIDE):  # two halves each: the first ones are forgotten
        buffer.add(chunk(start % 5, 1))
    buffer.add(chunk(20, 1))
    buffer.begin(0)
    assert_holds(buffer, 20)
    assert_holds(buffer, 4)


def test_the_longest_lead_and_chunk_of_a_mission_find_place() -> None:
    buffer, length = ReferenceBuffer(1), 10_000
    buffer.begin(70_000)
    for start in range(70_000, 90_000, length):
        buffer.add(chunk(start, length, n=1))
    assert all(buffer.covers(tick) for tick in range(70_000, 90_000))


# Where the mission stays away


@given(
    st.lists(st.tuples(st.integers(0, 3 * CAPACITY), st.integers(1, 8)), max_size=6),
    st.lists(st.tuples(st.integers(0, 3 * CAPACITY), st.integers(1, 8)), max_size=6),
    st.integers(0, 4 * CAPACITY),
)
def test_held_is_the_last_whole_point_before_at_rest(
    joints: list[tuple[int, int]], base: list[tuple[int, int]], tick: int
) -> None:
    """Of what is still in the ring; a point needs both parts; none from the future is taken."""
    buffer = ReferenceBuffer(2, CAPACITY)
    for start, length in joints:
        buffer.add_joints(start, chunk(start, length).joints)
    for start, length in base:
        buffer.add_base(start, chunk(start, length).base)
    there = [k for k in range(tick + 1) if buffer.covers(k)]
    held = buffer.hold(tick)
    if not there:
        assert held is None
        return
    assert held is not None
    expected = chunk(there[-1], 1)
    expected.joints[0, 1:], expected.base[0, 4:] = 0.0, 0.0
    np.testing.assert_array_equal(held, expected.references())


def test_what_is_held_is_a_copy() -> None:
    buffer = ReferenceBuffer(2, CAPACITY)
    buffer.add(chunk(0, 4))
    held = buffer.hold(10)
    assert held is not None
    for part in Reference.parts(held):
        part[:] = -1.0
    assert_holds(buffer, 3)


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e300])
@pytest.mark.parametrize("part", ["joints", "base"])
def test_rows_that_make_no_sense_are_refused_as_a_whole(part: str, value: float) -> None:
    """A law would carry a NaN on in its integral for ever."""
    buffer, bad = ReferenceBuffer(2, CAPACITY), chunk(0, 4)
    getattr(bad, part)[2, -1] = value
    with pytest.raises(MessageError, match="reference from tick 0") as caught:
        getattr(buffer, f"add_{part}")(0, getattr(bad, part))
    assert caught.value.reason == "not finite"
    buffer.add(chunk(0, 4))
    assert_holds(buffer, 2)
