"""Deadlines by the wall clock, by what holds however busy the machine is."""

from __future__ import annotations

import time
from dataclasses import dataclass

from hypothesis import given
from hypothesis import strategies as st

from space_robot_sim.wall_clock import SLIP_S, WallClock

ROUNDING_S = 1e-6
periods = st.floats(1e-4, 1e-2)
ticks = st.integers(0, 10**7)


@dataclass
class Stopwatch:
    """Bounds what two looks at a clock can differ by."""

    began: float

    @property
    def elapsed(self) -> float:
        return time.monotonic() - self.began + ROUNDING_S


@given(periods, ticks)
def test_a_tick_lasts_no_longer_than_its_period(period: float, tick: int) -> None:
    clock, watch = WallClock(period), Stopwatch(time.monotonic())
    clock.start(tick)
    left = clock.left(tick)
    assert period - watch.elapsed <= left <= period + ROUNDING_S


@given(periods, ticks, st.integers(-(10**6), 10**6))
def test_deadlines_are_whole_periods_apart(period: float, tick: int, later: int) -> None:
    """Also after any number of ticks: nothing drifts."""
    clock = WallClock(period)
    clock.start(tick)
    watch = Stopwatch(time.monotonic())
    one = clock.left(tick)
    other = clock.left(tick + later)
    assert one + later * period - other + ROUNDING_S >= 0.0
    assert one + later * period - other <= watch.elapsed


@given(periods, ticks, st.lists(st.floats(0.0, 10.0), max_size=5))
def test_only_hopelessly_missed_deadlines_slip(
    period: float, tick: int, behind: list[float]
) -> None:
    """A tick whose deadline lies ``behind`` s in the past; what slips is returned and added up."""
    clock, slipped = WallClock(period), 0.0
    clock.start(tick)
    for seconds in behind:
        missed = tick - round(seconds / period)
        watch = Stopwatch(time.monotonic())
        before = clock.left(missed)
        slip = clock.slip(missed)
        left = clock.left(missed)
        assert slip == 0.0 or slip >= SLIP_S
        assert (slip > 0.0) or before > -SLIP_S
        if slip:
            assert -watch.elapsed <= left <= 0.0 + ROUNDING_S  # due now
        assert before + slip - watch.elapsed - ROUNDING_S <= left <= before + slip + ROUNDING_S
        slipped += slip
    assert clock.slipped_s == slipped
