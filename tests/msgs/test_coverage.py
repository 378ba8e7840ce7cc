"""Counting many messages at once is counting each of them."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.coverage import LONGEST_JUMP, Coverage

steps = st.sampled_from([1, 1, 1, 1, 2, 5, 0, -1, -3, 19_999, 20_001, 10**12])
batches = st.lists(st.lists(steps, max_size=12), max_size=6)


@pytest.mark.parametrize("topic", [topics.JOINT_STATES, topics.CLOCK, topics.LAW])
@given(st.integers(-5, 100_000), batches)
def test_a_batch_counts_as_its_messages_one_by_one(
    topic: topics.Topic, first: int, given_steps: list[list[int]]
) -> None:
    at_once, singly, tick = Coverage(topic), Coverage(topic), first
    for batch in given_steps:
        ticks = tick + np.cumsum([0, *batch], dtype=np.int64)[:-1]
        tick += sum(batch)
        assert at_once.take_all(ticks).tolist() == [singly.take(int(k)) for k in ticks]
    for field in fields(Coverage):
        if field.name != "_guard":
            assert getattr(at_once, field.name) == getattr(singly, field.name), field.name


def test_events_may_come_whenever_they_like() -> None:
    """Two of one tick are two, a long silence is no strange stamp, none at all is no loss."""
    coverage = Coverage(topics.LAW)
    assert coverage.missing(1000) == 0
    for tick in (0, 7, 7, 3 * LONGEST_JUMP, 9):
        assert coverage.take(tick)
    assert (coverage.received, coverage.repeated, coverage.strange) == (5, 0, 0)
    assert coverage.missing(4 * LONGEST_JUMP) == 0
