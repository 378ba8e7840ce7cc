"""The command in force: whatever comes, only a finite, timely one acts, and not for ever."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from space_robot_sim.plant.command_guard import CommandGuard

AXES, HOLD = 3, 10

torques = st.lists(st.floats(width=64), min_size=AXES, max_size=AXES)
"""NaN, infinities and the largest numbers among them."""
arrivals = st.lists(
    st.tuples(
        st.integers(0, 4), st.lists(st.tuples(st.integers(-2 * HOLD, 5), torques), max_size=3)
    ),
    max_size=40,
)
"""At each step the ticks that pass, then the commands that come: stamp less now, torque."""


def offer(guard: CommandGuard, now: int, stamp: int, torque: float | list[float]) -> bool:
    guard.offered.tick = stamp
    guard.offered.torque[:] = torque
    return guard.accept(now)


@given(arrivals, st.integers(0, HOLD))
@example([(0, [(0, [np.inf, -np.inf, 0.0])])], HOLD)
@example([(0, [(0, [1.7e308] * AXES)])], HOLD)
def test_what_acts_is_the_newest_good_command_while_it_is_young(
    stream: list[tuple[int, list[tuple[int, list[float]]]]], hold_ticks: int
) -> None:
    """Against the rule in other words; every command is accepted or counted."""
    guard, now, offered, good = CommandGuard(AXES, hold_ticks), 0, 0, {-1: [0.0] * AXES}
    for elapsed, commands in stream:
        now += elapsed
        for delay, torque in commands:
            stamp = now + delay
            is_good = max(good) < stamp <= now and all(np.isfinite(torque))
            assert offer(guard, now, stamp, torque) == is_good
            if is_good:
                good[stamp] = torque
            offered += 1
        newest = max(good)
        acting = guard.act(now)
        acts = newest >= 0 and now - newest <= hold_ticks
        np.testing.assert_array_equal(acting.torque, good[newest] if acts else np.zeros(AXES))
        assert guard.is_safe == (not acts)
        assert guard.answered == newest
    assert guard.refused.total() + len(good) - 1 == offered


def test_a_command_is_held_and_then_none_acts() -> None:
    guard = CommandGuard(AXES, HOLD)
    assert offer(guard, 7, 7, 1.5)
    torques = [guard.act(7 + held).torque[0] for held in range(HOLD + 5)]
    assert torques == [1.5] * (HOLD + 1) + [0.0] * 4
    assert offer(guard, 30, 30, 2.5)  # and back
    assert guard.act(30).torque[0] == 2.5
    assert not guard.is_safe


def test_a_late_command_acts_only_for_what_is_left_of_its_time() -> None:
    """One that comes after all of it does not bring the torque back."""
    guard = CommandGuard(AXES, HOLD)
    assert offer(guard, 8, 0, 1.0)
    assert [guard.act(now).torque[0] for now in (8, HOLD, HOLD + 1)] == [1.0, 1.0, 0.0]
    assert offer(guard, 100, 50, 2.0)
    assert guard.act(100).torque[0] == 0.0
    assert guard.held_ticks(100) == 50


@pytest.mark.parametrize(
    ("stamp", "torque", "reason"),
    [
        (5, 1.0, "stamp"),
        (4, 1.0, "stamp"),
        (7, 1.0, "stamp"),
        (6, np.nan, "not finite"),
        (6, -np.inf, "not finite"),
    ],
)
def test_a_refused_command_is_counted_and_changes_nothing(
    stamp: int, torque: float, reason: str
) -> None:
    """Repeated, older, of a state never sent, not finite."""
    guard = CommandGuard(AXES, HOLD)
    assert offer(guard, 5, 5, 0.5)
    assert not offer(guard, 6, stamp, torque)
    assert guard.refused == {reason: 1}
    assert guard.act(6).torque.tolist() == [0.5] * AXES
    assert guard.answered == 5


def test_unreadable_commands_are_counted() -> None:
    guard = CommandGuard(AXES, HOLD)
    guard.refuse("names")
    guard.refuse("names")
    assert guard.refused == {"names": 2}


def test_released_there_is_no_torque_until_a_new_command() -> None:
    guard = CommandGuard(AXES, HOLD)
    assert offer(guard, 0, 0, 1.0)
    guard.release()
    assert not guard.act(0).torque.any()
    assert offer(guard, 1, 1, 1.0)
    assert guard.act(1).torque.all()


def test_before_the_first_command_there_is_no_torque() -> None:
    guard = CommandGuard(AXES, HOLD)
    assert guard.answered == -1
    assert not guard.act(0).torque.any()
    assert guard.is_safe
