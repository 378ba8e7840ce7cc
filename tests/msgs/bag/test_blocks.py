"""Flights analyzed block by block: the same figures, wherever the blocks are cut."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_logs import random_log

from space_robot.analysis import Analysis, analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import fly_blocks, simulate
from space_robot_msgs_py.bag import blocks
from space_robot_msgs_py.bag.blocks import BLOCK_TICKS, block_bounds, blocks_of, joined, last_rows
from space_robot_msgs_py.bag.flight_log import REFERENCE, FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.samples import STATE_FIELDS

COLUMNS = (*STATE_FIELDS, *REFERENCE, "commanded_torque")


def analyzed(log: FlightLog, cuts: list[int]) -> dict[str, Any]:
    analysis = Analysis()
    for start, stop in itertools.pairwise([0, *sorted({*cuts} - {log.ticks}), log.ticks]):
        analysis.add(log.rows(start, stop))
    return analysis.report()


def assert_close(one: Any, other: Any) -> None:
    """Equal but for the order of summation."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_close(one[key], other[key])
    else:
        assert other == (pytest.approx(one, rel=1e-11) if isinstance(one, float) else one)


@settings(max_examples=30)
@given(st.sampled_from([1, 3, 6, 7]), st.integers(0, 99), st.lists(st.integers(1, 399), max_size=5))
def test_blocks_make_the_whole(n: int, seed: int, cuts: list[int]) -> None:
    log = random_log(n, 400, seed, latency_ticks=seed % 4, wall_clock=seed % 2 == 0)
    assert_close(analyze(log), analyzed(log, cuts))


PLAN = FlightPlan.model_validate(
    {
        "duration": 0.3,
        "case": "3",
        "swaps": ["0.0755:ctc", "0.15:tde_stc"],
        "command_latency_ticks": 2,
        "faults": ["noise_attitude@0.01:1e-5", "torque_scale@0.05:joints=0.998"],
    }
)
FLOWN = simulate(Flight(resolve(PLAN)))


@settings(max_examples=10)
@given(st.lists(st.integers(1, 599), max_size=5))
def test_blocks_of_a_flight_make_the_whole(cuts: list[int]) -> None:
    """With what it measured and its laws beside the numbers."""
    assert_close(analyze(FLOWN), analyzed(FLOWN, cuts))


@given(st.integers(0, 4 * BLOCK_TICKS))
def test_bounds_follow_one_another(ticks: int) -> None:
    bounds = list(block_bounds(ticks))
    assert [k for pair in bounds for k in range(*pair, BLOCK_TICKS)] == [
        *range(0, ticks, BLOCK_TICKS)
    ]
    assert [b for _, b in bounds] == [*range(BLOCK_TICKS, ticks, BLOCK_TICKS), ticks][: len(bounds)]


def test_rows_joined_are_those_there_were() -> None:
    log = random_log(6, 30, 0)
    log.first_tick = 7
    before, after = last_rows(log.rows(0, 12), 5), log.rows(12, 30)
    both = joined(before, after)
    assert (both.first_tick, both.ticks) == (14, 23)
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(both, name), getattr(log, name)[7:])
        assert not np.shares_memory(getattr(before, name), getattr(log, name))
    assert last_rows(log, 99).ticks == 30
    assert joined(None, after) is after


def test_a_flight_whole_from_blocks_and_from_its_bag_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the last bit, log and report."""
    monkeypatch.setattr(blocks, "BLOCK_TICKS", 150)
    analysis, parts, log = Analysis(), [], None
    for block in fly_blocks(Flight(resolve(PLAN)), tmp_path / "bag"):
        analysis.add(block)
        parts.append((block.first_tick, block.ticks))
        log = joined(log, block)
    assert parts == [(0, 150), (150, 150), (300, 150), (450, 150)]
    assert log is not None
    assert FLOWN.measured is not None
    read = read_flight(tmp_path / "bag")
    for one in (log, read):
        assert one.measured is not None
        for name in COLUMNS:
            np.testing.assert_array_equal(getattr(one, name), getattr(FLOWN, name), name)
        for name in STATE_FIELDS:
            measured = getattr(FLOWN.measured, name)
            np.testing.assert_array_equal(getattr(one.measured, name), measured, name)
        np.testing.assert_array_equal(one.assumed_error, FLOWN.assumed_error)
        assert one.laws == FLOWN.laws
    np.testing.assert_array_equal(log.telemetry, FLOWN.telemetry)
    assert [block.ticks for block in blocks_of(FLOWN)] == [150] * 4
    assert analysis.report() == analyze(FLOWN) == analyze(read)
