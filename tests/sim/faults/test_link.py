"""What a faulty link does to the order and number of what is sent, and to the answers awaited."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.link import (
    COMMAND_LINK,
    STATE_LINK,
    DelayedMessage,
    Link,
    awaited_stamp,
)
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.faults import PLANT_KINDS

PERIOD = 5e-4
TICKS = 200
SEEDS = st.integers(0, 2**31 - 1)
KINDS = {"state": STATE_LINK, "command": COMMAND_LINK}
WHAT = st.sampled_from(list(KINDS))


def link(*texts: str, what: str = "state", seed: int = 0) -> Link[int]:
    return Link(Schedule(parse_faults(texts, PLANT_KINDS), seed, PERIOD), KINDS[what])


def fly(a_link: Link[int], ticks: int = TICKS) -> list[list[int]]:
    """What arrives, tick by tick, when each tick sends its own number."""
    return [[message.item for message in a_link.push(tick, tick)] for tick in range(ticks)]


PLAIN = [[tick] for tick in range(TICKS)]


@given(WHAT, SEEDS)
def test_faults_without_strength_change_nothing(what: str, seed: int) -> None:
    texts = [f"{kind}_{what}@0:0" for kind in ("drop", "repeat", "delay", "jitter")]
    assert fly(link(*texts, what=what, seed=seed)) == PLAIN
    assert fly(link(what=what)) == PLAIN


def test_faults_of_the_other_link_change_nothing() -> None:
    assert fly(link("drop_command@0", "delay_command@0:7", what="state")) == PLAIN


@given(WHAT, st.integers(0, 50), st.integers(0, 50))
def test_a_delay_shifts_and_two_add_up(what: str, first: int, second: int) -> None:
    arrived = fly(link(f"delay_{what}@0:{first}", f"delay_{what}@0:{second}", what=what))
    late = first + second
    assert arrived == [[]] * min(late, TICKS) + [[k] for k in range(max(TICKS - late, 0))]


def test_a_delay_that_ends_delivers_the_rest_late() -> None:
    """What was sent before the end is overtaken, not hurried and not lost."""
    arrived = fly(link("delay_state@0-0.002:3"), 8)
    assert arrived == [[], [], [], [0], [1, 4], [2, 5], [3, 6], [7]]


@given(SEEDS, st.floats(0.05, 0.95))
def test_drops_lose_some_and_delay_none(seed: int, probability: float) -> None:
    arrived = fly(link(f"drop_state@0:{probability!r}", seed=seed), 500)
    assert all(items in ([], [tick]) for tick, items in enumerate(arrived))
    lost = sum(not items for items in arrived) / 500
    assert lost == pytest.approx(probability, abs=5.0 * math.sqrt(0.25 / 500))


def test_certain_drops_last_as_long_as_they_should() -> None:
    arrived = fly(link("drop_state@0.005-0.01"))
    assert arrived == [[] if 10 <= tick < 20 else [tick] for tick in range(TICKS)]


@given(SEEDS, st.floats(0.0, 1.0))
def test_a_repeated_item_comes_again_beside_the_next(seed: int, probability: float) -> None:
    arrived = fly(link(f"repeat_state@0:{probability!r}", seed=seed))
    for tick, items in enumerate(arrived):
        assert items in ([tick], [tick - 1, tick])
    if probability == 1.0:
        assert arrived == [[0], *([tick - 1, tick] for tick in range(1, TICKS))]


@given(SEEDS, st.integers(0, 20), st.integers(0, 5))
def test_jitter_loses_nothing_repeats_nothing_and_is_bounded(
    seed: int, jitter: int, delay: int
) -> None:
    """In one tick the order of sending holds, whatever overtakes between ticks."""
    faulty = link(f"jitter_state@0:{jitter}", f"delay_state@0:{delay}", seed=seed)
    arrived = fly(faulty)
    arrived += [[p.item for p in faulty.arrivals(TICKS + k)] for k in range(jitter + delay)]
    assert sorted(item for items in arrived for item in items) == list(range(TICKS))
    for tick, items in enumerate(arrived):
        assert items == sorted(items)
        assert all(delay <= tick - item <= delay + jitter for item in items)
    lateness = {tick - item for tick, items in enumerate(arrived) for item in items}
    if jitter <= 5:
        assert lateness == set(range(delay, delay + jitter + 1)), "each as likely, so all occur"


@given(SEEDS)
def test_one_seed_gives_one_flight(seed: int) -> None:
    texts = ["drop_state@0:0.2", "repeat_state@0:0.3", "jitter_state@0:4"]
    assert fly(link(*texts, seed=seed)) == fly(link(*texts, seed=seed))
    assert fly(link(*texts, seed=seed)) != fly(link(*texts, seed=seed + 1))


@given(SEEDS)
def test_another_fault_changes_no_draw_of_the_first(seed: int) -> None:
    """Nothing that the first one drops arrives when a second one drops more."""
    alone = fly(link("drop_state@0:0.3", seed=seed))
    both = fly(link("drop_state@0:0.3", "drop_state@0:0.3", seed=seed))
    assert all(more in (items, []) for items, more in zip(alone, both, strict=True))
    assert both != alone


def test_ticks_that_are_skipped_lose_nothing() -> None:
    """A plant that sends nothing at a tick still gets all that was due, oldest first."""
    slow = link("delay_command@0-0.001:2", what="command")
    for tick in range(4):
        slow.send(tick, tick)
    assert [message.item for message in slow.arrivals(9)] == [0, 2, 1, 3]
    assert slow.arrivals(10) == []


def test_messages_carry_their_stamp_and_the_item_itself() -> None:
    item = np.zeros(3)
    a_link: Link[object] = Link(Schedule([], 0, PERIOD), STATE_LINK)
    (plain,) = a_link.push(5, item)
    (stamped,) = a_link.push(6, item, 2)
    assert plain.item is item
    assert (plain.stamp, stamped.stamp) == (5, 2)


def states(*stamps: int) -> list[DelayedMessage[None]]:
    return [DelayedMessage(0, serial, stamp, None) for serial, stamp in enumerate(stamps)]


@pytest.mark.parametrize(
    ("stamps", "awaited"),
    [
        ((7,), 7),
        ((), None),  # lost or late
        ((6, 7), 7),  # one came again beside the new one
        ((5,), 5),  # late, but newer than what was answered
        ((4,), None),  # answered before
        ((1_000_007,), None),  # stamped far ahead
        ((5, 6, 3), 6),
    ],
)
def test_the_answer_that_is_awaited(stamps: tuple[int, ...], awaited: int | None) -> None:
    assert awaited_stamp(states(*stamps), tick=7, answered=4) == awaited
