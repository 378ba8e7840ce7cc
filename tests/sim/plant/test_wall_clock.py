"""Deadlines by the wall clock, by what holds however busy the machine is."""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_sim.plant.wall_clock import REMARK_S, SLIP_S, WallClock

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
    assert clock.lost_time_s == slipped


def test_lost_time_is_remarked_at_most_every_few_seconds_with_its_sum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A machine that is too slow loses time three times a second."""
    now, remarks = 1000.0, []
    monkeypatch.setattr(time, "monotonic", lambda: now)
    clock = WallClock(1e-3)
    clock.start(0)
    while now < 1020.0:
        now += 0.3  # a tick takes 300 ms
        if clock.slip(0) and (remark := clock.remark()):
            remarks.append((now, remark))
        clock.start(0)
    moments = [moment for moment, _ in remarks]
    assert 3 <= len(remarks) <= 20.0 / REMARK_S + 1
    assert all(later - earlier >= REMARK_S for earlier, later in pairwise(moments))
    assert remarks[0][1] == "0.299 s behind the wall clock: time goes on from here"
    in_all = float(remarks[-1][1].split(", ")[1].split(" s in all")[0])
    assert in_all == pytest.approx(0.299 * round((moments[-1] - 1000.0) / 0.3), abs=1e-3)
    assert clock.remark() == ""
