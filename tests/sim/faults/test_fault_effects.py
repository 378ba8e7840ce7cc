"""Faults: axes, times, random numbers, messages that they corrupt, and links that fail."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_samples import random_sample
from scipy.stats import chisquare
from strategies import SEEDS, random_quaternion

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import (
    PASSIVE_FIELDS,
    SENSED_FIELDS,
    Command,
    RobotNames,
    RobotState,
)
from space_robot_msgs_py.topics import BASE_AXES
from space_robot_sim.component import TemporaryChange
from space_robot_sim.faults.grammar import About, axes_of, parse_fault, parse_faults
from space_robot_sim.faults.messages import (
    STAMP_BACK_TICKS,
    STAMP_JUMP_TICKS,
    DelayedMessage,
    Link,
    MessageFaults,
    awaited_stamp,
)
from space_robot_sim.faults.schedule import BLOCK_TICKS, Schedule, ScheduledFault
from space_robot_sim.plant.settings import PLANT_KINDS

JOINTS = st.lists(st.text(min_size=1, max_size=5), min_size=1, max_size=9, unique=True)
PAPER = RobotNames(
    tuple(f"joint_{k}" for k in range(1, 7)), ("wheel_1", "wheel_2"), ("thruster_1",)
)


@given(JOINTS)
def test_every_name_is_its_own_axis(joints: list[str]) -> None:
    """A joint named ``2``, ``all`` or ``base`` too: what has a name is called by it."""
    names = RobotNames(tuple(joints))
    for place, name in enumerate(names.axes):
        if names.axes.count(name) == 1:
            assert axes_of(name, About.AXIS, names) == (place,)
            if place >= len(BASE_AXES):
                assert axes_of(name, About.JOINT, names) == (place,)


PERIOD = 5e-4
MANY_TICKS = 20 * BLOCK_TICKS


def placed(text: str, index: int = 0, seed: int = 0, **names: Any) -> ScheduledFault:
    robot = RobotNames(("shoulder", "elbow"), **names)
    return ScheduledFault(parse_fault(text, PLANT_KINDS), index, seed, PERIOD, robot)


@pytest.mark.parametrize(
    ("text", "first", "stop"),
    [
        ("drop_state@0", 0, math.inf),
        ("drop_state@0.01-0.02", 20, 40),
        ("drop_state@0.0101-0.0196", 21, 40),
        ("drop_state@0.01-0.0101", 20, 21),
    ],
)
def test_it_acts_from_its_first_tick_to_before_its_end(text: str, first: int, stop: float) -> None:
    fault = placed(text)
    assert [tick for tick in range(100) if fault.acts_at(tick)] == list(
        range(first, int(min(stop, 100)))
    )
    assert (fault.first, fault.stop) == (first, stop)


def test_a_time_without_a_tick_is_refused() -> None:
    with pytest.raises(InputError) as caught:
        placed("drop_state@0.0101-0.0102")
    assert str(caught.value) == (
        "fault 'drop_state@0.0101-0.0102': there is no tick of 0.0005 s in that time"
    )


@pytest.mark.parametrize("share", [0.0, 0.1, 1.0])
def test_a_probability_is_the_share_of_ticks_and_choices_are_even(share: float) -> None:
    fault = placed(f"drop_state@0.05:{share}")
    first, happened = 100, [fault.happens_at(tick) for tick in range(MANY_TICKS)]
    assert not any(happened[:first])
    spread = 5.0 * math.sqrt(share * (1.0 - share) / MANY_TICKS)
    assert np.mean(happened[first:]) == pytest.approx(share, abs=spread + 1e-12)
    chosen = [fault.choose(tick, 7) for tick in range(MANY_TICKS)]
    assert chisquare(np.bincount(chosen, minlength=7)).pvalue > 1e-4
    assert max(chosen) == 6
    if share == 0.1:
        where = np.array(chosen[first:])[np.array(happened[first:])]
        assert chisquare(np.bincount(where, minlength=7)).pvalue > 1e-4, "independent of it"


@given(st.lists(st.integers(0, 3 * BLOCK_TICKS), min_size=1, max_size=20))
def test_numbers_are_those_of_the_tick_whatever_was_asked_before(ticks: list[int]) -> None:
    asked = placed("drop_state@0:1")
    for tick in ticks:
        assert asked.choose(tick, 10**9) == placed("drop_state@0:1").choose(tick, 10**9)


def test_each_seed_and_each_place_in_the_list_has_its_own_numbers() -> None:
    numbers = [
        placed("drop_state@0:1", index, seed).choose(tick, 10**9)
        for index in range(2)
        for seed in range(2)
        for tick in (0, 1, BLOCK_TICKS)
    ]
    assert len(set(numbers)) == 12
    texts = ("drop_state@0", "nan_state@0", "drop_state@1")
    schedule = Schedule([parse_fault(text, PLANT_KINDS) for text in texts], 1, PERIOD)
    (second,) = schedule.of("nan_state")
    assert second.choose(5, 10**9) == placed(texts[1], 1, 1).choose(5, 10**9)
    assert schedule.of("drop_state") == [schedule.faults[0], schedule.faults[2]]
    assert schedule.of("inf_state") == []


def test_changes_are_taken_back_once_no_fault_acts() -> None:
    """Two that overlap; between the changes the part may be set anew by others."""
    faults = [placed("drive_scale@0.005-0.02:base=0.5"), placed("drive_scale@0.01-0.03:base=3")]
    change, values = TemporaryChange("scale", faults), np.array([1.0, 2.0, 3.0])
    record = {"scale": values}
    seen = {tick: (change.apply(tick, record), *values[:2].tolist()) for tick in range(9)}
    assert set(seen.values()) == {(False, 1.0, 2.0)}
    values[:2] = 10.0, 20.0
    seen = {tick: (change.apply(tick, record), *values[:2].tolist()) for tick in range(9, 70)}
    expected = {9: 1.0, 10: 0.5, 20: 1.5, 40: 3.0, 60: 1.0}
    for tick, row in seen.items():
        factor = expected[max(k for k in expected if k <= tick)]
        assert row == (tick in expected and tick > 9, 10.0 * factor, 20.0 * factor)


N = 6


def schedule(*texts: str, seed: int = 0) -> Schedule:
    return Schedule(parse_faults(texts, PLANT_KINDS), seed, PERIOD)


def a_state(tick: int, seed: int = 1) -> RobotState:
    state = random_sample(N, seed, tick)
    state.quaternion[:] = random_quaternion(np.random.default_rng(seed))
    return state


@pytest.mark.parametrize(
    ("kind", "test", "passive", "share"),
    [("nan_state", np.isnan, 3, 0.5), ("inf_state", np.isposinf, 0, 1.0)],
)
def test_one_measured_number_is_not_finite(
    kind: str, test: Any, passive: int, share: float
) -> None:
    """Any of them, each as likely, never the echo of the torque, nothing else; P of the ticks."""
    corruption = MessageFaults(schedule(f"{kind}@0:{share}"), N, passive)
    seen = Counter[Any]()
    ticks, numbers = 1500, 3 + 4 + 3 + 3 + 2 * N + 2 * passive
    for tick in range(ticks):
        state = a_state(0)
        corruption.corrupt_state(state, tick)
        places = np.flatnonzero(~np.isfinite(state.numbers))
        assert test(state.numbers[places]).all()
        assert (state.numbers == a_state(0).numbers).sum() == state.numbers.size - places.size
        seen.update(places.tolist())
        assert places.size <= 1
    allowed = RobotState.allocate(N)
    for name in SENSED_FIELDS:
        getattr(allowed, name)[:] = 1.0
    for name in PASSIVE_FIELDS:
        getattr(allowed, name)[:passive] = 1.0
    assert set(seen) == set(np.flatnonzero(allowed.numbers).tolist())
    assert seen.total() == pytest.approx(share * ticks, abs=5.0 * np.sqrt(0.25 * ticks))
    assert chisquare(list(seen.values())).pvalue > 1e-3
    assert len(seen) == numbers


def test_a_scaled_quaternion_is_off_by_a_tenth_both_ways() -> None:
    corruption, norms = MessageFaults(schedule("scaled_quaternion@0"), N), set()
    for tick in range(100):
        state = a_state(tick)
        corruption.corrupt_state(state, tick)
        norms.add(round(float(np.linalg.norm(state.quaternion)), 12))
    assert norms == {0.9, 1.1}


def test_stamps_go_back_or_far_ahead_and_never_below_zero() -> None:
    back, ahead = (
        MessageFaults(schedule("stamp_back@0"), N),
        MessageFaults(schedule("stamp_jump@0"), N),
    )
    steps = {tick - back.stamp(tick) for tick in range(100, 500)}
    assert steps == set(range(1, STAMP_BACK_TICKS + 1))
    assert all(0 <= back.stamp(tick) < max(tick, 1) for tick in range(20))
    assert {ahead.stamp(tick) - tick for tick in range(100)} == {STAMP_JUMP_TICKS}
    plain = MessageFaults(schedule("stamp_back@0:0", "stamp_jump@5"), N)
    assert [plain.stamp(tick) for tick in range(100)] == list(range(100))


@pytest.mark.parametrize(("kind", "test"), [("nan_command", np.isnan), ("inf_command", np.isinf)])
def test_one_commanded_torque_is_not_finite(kind: str, test: Any) -> None:
    corruption, seen = MessageFaults(schedule(f"{kind}@0.1"), N), set()
    for tick in range(400):
        command = Command(tick, np.ones(N + 3))
        corruption.corrupt_command(command, tick)
        assert test(command.torque).sum() == (tick >= 200)
        assert (command.torque == 1.0).sum() == N + 3 - (tick >= 200)
        seen |= set(np.flatnonzero(test(command.torque)).tolist())
    assert seen == set(range(N + 3))


@pytest.mark.parametrize(
    ("about", "name", "axes"),
    [
        *((about, "joint_3", (5,)) for about in (About.AXIS, About.JOINT)),
        *((about, "6", (8,)) for about in (About.AXIS, About.JOINT)),
        *((about, "joints", (3, 4, 5, 6, 7, 8)) for about in (About.AXIS, About.JOINT)),
        *((about, "base_y", (1,)) for about in (About.AXIS, About.BASE_AXIS)),
        *((about, "base", (0, 1, 2)) for about in (About.AXIS, About.BASE_AXIS)),
        (About.AXIS, "all", tuple(range(9))),
        *((About.WHEEL, *row) for row in (("wheel_2", (1,)), ("1", (0,)), ("wheels", (0, 1)))),
        *((About.THRUSTER, name, (0,)) for name in ("thruster_1", "1", "thrusters")),
    ],
)
def test_names_numbers_and_groups(about: About, name: str, axes: tuple[int, ...]) -> None:
    assert axes_of(name, about, PAPER) == axes


TICKS = 200
WHAT = st.sampled_from(["state", "command"])


def link(*texts: str, what: str = "state", seed: int = 0) -> Link[int]:
    return Link(Schedule(parse_faults(texts, PLANT_KINDS), seed, PERIOD), what)


def sent_over(a_link: Link[int], ticks: int = TICKS) -> list[list[int]]:
    """What arrives, tick by tick, when each tick sends its own number."""
    return [[message.item for message in a_link.push(tick, tick)] for tick in range(ticks)]


PLAIN = [[tick] for tick in range(TICKS)]


@given(WHAT, SEEDS)
def test_faults_without_strength_change_nothing(what: str, seed: int) -> None:
    texts = [f"{kind}_{what}@0:0" for kind in ("drop", "repeat", "delay", "jitter")]
    assert sent_over(link(*texts, what=what, seed=seed)) == PLAIN
    assert sent_over(link(what=what)) == PLAIN


@given(WHAT, st.integers(0, 50), st.integers(0, 50))
def test_a_delay_shifts_and_two_add_up(what: str, first: int, second: int) -> None:
    arrived = sent_over(link(f"delay_{what}@0:{first}", f"delay_{what}@0:{second}", what=what))
    late = first + second
    assert arrived == [[]] * min(late, TICKS) + [[k] for k in range(max(TICKS - late, 0))]


@given(SEEDS, st.floats(0.05, 0.95))
def test_drops_lose_some_and_delay_none(seed: int, probability: float) -> None:
    arrived = sent_over(link(f"drop_state@0:{probability!r}", seed=seed), 500)
    assert all(items in ([], [tick]) for tick, items in enumerate(arrived))
    lost = sum(not items for items in arrived) / 500
    assert lost == pytest.approx(probability, abs=5.0 * math.sqrt(0.25 / 500))


@given(SEEDS, st.floats(0.0, 1.0))
def test_a_repeated_item_comes_again_beside_the_next(seed: int, probability: float) -> None:
    arrived = sent_over(link(f"repeat_state@0:{probability!r}", seed=seed))
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
    arrived = sent_over(faulty)
    arrived += [[p.item for p in faulty.arrivals(TICKS + k)] for k in range(jitter + delay)]
    assert sorted(item for items in arrived for item in items) == list(range(TICKS))
    for tick, items in enumerate(arrived):
        assert items == sorted(items)
        assert all(delay <= tick - item <= delay + jitter for item in items)
    lateness = {tick - item for tick, items in enumerate(arrived) for item in items}
    if jitter <= 5:
        assert lateness == set(range(delay, delay + jitter + 1)), "each as likely, so all occur"


def test_ticks_that_are_skipped_lose_nothing() -> None:
    """A plant that sends nothing at a tick still gets all that was due, oldest first."""
    slow = link("delay_command@0-0.001:2", what="command")
    for tick in range(4):
        slow.send(tick, tick)
    assert [message.item for message in slow.arrivals(9)] == [0, 2, 1, 3]
    assert slow.arrivals(10) == []


def delayed(*stamps: int) -> list[DelayedMessage[None]]:
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
    assert awaited_stamp(delayed(*stamps), tick=7, answered=4) == awaited
