"""Flights analyzed block by block: the same figures, wherever the blocks are cut."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import random_log

from space_robot.analysis import Analysis, analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import fly_blocks, simulate
from space_robot_msgs_py.bag import blocks
from space_robot_msgs_py.bag.blocks import BLOCK_TICKS, block_bounds, blocks_of, joined, last_rows
from space_robot_msgs_py.bag.flight_log import REFERENCE, FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.samples import STATE_FIELDS


def analyzed(log: FlightLog, cuts: list[int]) -> dict[str, Any]:
    analysis = Analysis()
    edges = [0, *sorted(cuts), log.ticks]
    for start, stop in itertools.pairwise(edges):
        if start < stop:
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


@given(st.sampled_from([1, 3, 6, 7]), st.integers(0, 99), st.lists(st.integers(1, 399), max_size=5))
def test_blocks_make_the_whole(n: int, seed: int, cuts: list[int]) -> None:
    log = random_log(n, 400, seed, latency_ticks=seed % 4, wall_clock=seed % 2 == 0)
    whole = analyze(log)
    assert (whole["settling"] is None) <= (whole["unavailable"].keys() >= {"settling"})
    assert_close(whole, analyzed(log, cuts))


FLOWN = simulate(Flight(resolve(FlightPlan(duration=1.0, case="3"))))


@settings(max_examples=20)
@given(st.lists(st.integers(1, 199), max_size=5))
def test_blocks_of_a_flight_make_the_whole(cuts: list[int]) -> None:
    """With all its figures, the end effector's pointing among them."""
    assert not analyze(FLOWN)["unavailable"].keys() - {"latency"}
    assert_close(analyze(FLOWN), analyzed(FLOWN, cuts))


@given(st.integers(0, 4 * BLOCK_TICKS))
def test_bounds_follow_one_another(ticks: int) -> None:
    bounds = list(block_bounds(ticks))
    assert [k for a, b in bounds for k in (a, b)][1:-1] == [
        k for a, _ in bounds[1:] for k in (a, a)
    ]
    assert not bounds or (bounds[0][0], bounds[-1][1]) == (0, ticks)
    assert all(0 < b - a <= BLOCK_TICKS for a, b in bounds)
    assert all(b - a == BLOCK_TICKS for a, b in bounds[:-1])


def test_the_papers_mission_is_one_block() -> None:
    assert list(block_bounds(60_000)) == [(0, 60_000)]


def test_rows_joined_are_those_there_were() -> None:
    log = random_log(6, 30, 0)
    log.first_tick = 7
    before, after = last_rows(log.rows(0, 12), 5), log.rows(12, 30)
    both = joined(before, after)
    assert (both.first_tick, both.ticks) == (14, 23)
    for name in (*STATE_FIELDS, *REFERENCE, "commanded_torque"):
        np.testing.assert_array_equal(getattr(both, name), getattr(log, name)[7:])
        assert not np.shares_memory(getattr(before, name), getattr(log, name))
    assert last_rows(log, 99).ticks == 30
    assert joined(None, after) is after


@pytest.fixture
def short_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "BLOCK_TICKS", 150)


@pytest.mark.usefixtures("short_blocks")
@pytest.mark.parametrize(
    "options",
    [
        {"controller": "tde_smc", "case": "4-2"},
        {"command_latency_ticks": 3},
        {"swaps": ["0.0755:ctc", "0.15:tde_stc"]},
        {"robot": "seven_joint"},
        {"parameters": {"controller": {"acceleration_filter_hz": 100.0}}},
    ],
    ids=str,
)
def test_a_long_flight_in_memory_from_blocks_and_from_its_bag_is_the_same(
    options: dict[str, Any], tmp_path: Path
) -> None:
    """To the last bit, log and report."""
    plan = FlightPlan.model_validate({"duration": 0.3, **options})
    whole, analysis = simulate(Flight(resolve(plan))), Analysis()
    parts = list(fly_blocks(Flight(resolve(plan)), tmp_path / "bag"))
    assert [block.first_tick for block in parts] == [0, 150, 300, 450]
    for block in parts:
        analysis.add(block)
    read = read_flight(tmp_path / "bag")
    for name in (*STATE_FIELDS, *REFERENCE, "commanded_torque", "telemetry"):
        column = np.concatenate([getattr(block, name) for block in parts])
        np.testing.assert_array_equal(column, getattr(whole, name))
        if name != "telemetry":
            np.testing.assert_array_equal(column, getattr(read, name))
    assert parts[-1].laws == whole.laws == read.laws
    assert analysis.report() == analyze(whole) == analyze(read)


def test_blocks_are_flown_as_the_whole_is(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = FlightPlan(duration=0.3, case="3", command_latency_ticks=2)
    whole = simulate(Flight(resolve(plan)))
    monkeypatch.setattr(blocks, "BLOCK_TICKS", 70)
    parts = simulate(Flight(resolve(plan)))
    assert [b.ticks for b in blocks_of(parts)][-2:] == [70, 40]
    for name in (*STATE_FIELDS, *REFERENCE, "commanded_torque", "telemetry"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))
