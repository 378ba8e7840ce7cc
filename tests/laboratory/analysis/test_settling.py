"""Settling times of hand-made errors, and waypoints, against plain loops."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from space_robot.analysis import excerpt
from space_robot.analysis.settling import BAND, Settling
from space_robot.analysis.waypoints import Waypoints
from space_robot.flight.flown_log import empty_log
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_msgs_py.bag.blocks import blocks_of
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase

PERIOD = 0.0005
WATCH = 200
"""Ticks of flight that a waypoint must have after it."""


def log_with(speed: np.ndarray, first_tick: int = 0) -> FlightLog:
    """One joint with these desired speeds (N,)."""
    log = FlightLog.allocate(len(speed), ("j",), Timebase(500_000))
    log.first_tick = first_tick
    log.reference_joints[:], log.reference_joints[:, 1, 0] = 0.0, speed
    return log


def settling_of(log: FlightLog, error: np.ndarray, cuts: tuple[int, ...] = ()) -> Settling:
    figure = Settling(log, band=1.0)
    for start, stop in zip((0, *cuts), (*cuts, log.ticks), strict=True):
        figure.add(log.rows(start, stop), error[start:stop])
    return figure


def last_waypoint(log: FlightLog) -> int | None:
    figure = Settling(log)
    for block in blocks_of(log):
        figure.add(block, np.zeros((block.ticks, log.axes)))
    return figure.last_waypoint


@given(
    arrays(np.float64, (300, 4), elements=st.floats(-2.0, 2.0)),
    st.integers(0, 100),
    st.integers(0, 300),
    st.sets(st.integers(0, 300), max_size=40),
    st.integers(0, 50),
)
def test_after_it_the_error_stays_in_the_band_and_before_it_does_not(
    error: np.ndarray, start: int, calm_from: int, loud: set[int], first_tick: int
) -> None:
    """Of the base's and the joint's column alike; the largest in size of the axes counts."""
    error[calm_from:] *= 0.4
    for k in loud:
        error[k % 300, 2] = -1.5
    speed = np.ones(300)
    speed[start] = 0.0
    log = log_with(speed, first_tick)
    found = settling_of(log, error).result()
    assert found["band"] == 1.0
    assert found["after_s"] == pytest.approx((first_tick + start) * PERIOD)
    for name, axes in (("attitude", slice(0, 3)), ("joints_1_1", slice(3, 4))):
        size = np.max(np.abs(error[:, axes]), axis=1)
        rows = [k for k in range(start, 300) if np.all(size[k:] <= 1.0)]
        expected = (rows[0] - start) * PERIOD if rows else None
        assert found["settled_s"][name] == pytest.approx(expected)
    assert settling_of(log, error, (1, 77, 77, 230)).result() == found


def test_of_a_decay_it_is_the_logarithm() -> None:
    time = np.arange(4000) * PERIOD
    log = log_with(np.where(time == 0.0, 0.0, 1.0))
    error = np.tile(1e3 * np.exp(-time / 0.1)[:, np.newaxis], 4)
    settled = settling_of(log, error).result()["settled_s"]
    assert settled["attitude"] == pytest.approx(0.1 * np.log(1e3), abs=PERIOD)


def test_a_flight_that_never_rests_settles_nowhere() -> None:
    log = log_with(np.ones(300))
    with pytest.raises(InputError, match="does not come to rest"):
        settling_of(log, np.zeros((300, 4))).result()


@pytest.mark.parametrize(
    ("duration", "expected"), [(30.0, 30_000), (31.0, 60_000), (14.0, 0), (0.5, 0), (0.05, None)]
)
def test_the_last_waypoint_has_flight_after_it(duration: float, expected: int | None) -> None:
    assert last_waypoint(empty_log(Flight(resolve(FlightPlan(duration=duration))))) == expected


def test_the_shortest_watch() -> None:
    for rows, expected in ((WATCH + 1, 1), (WATCH, 0), (WATCH - 1, None)):
        speed = np.ones(rows)
        speed[:2] = 0.0
        assert last_waypoint(log_with(speed)) == expected


def test_an_excerpt_without_rest_has_none() -> None:
    log = empty_log(Flight(resolve(FlightPlan(duration=30.0))))
    assert last_waypoint(excerpt(log, 5.0, 10.0)) is None
    assert last_waypoint(excerpt(log, 12.0, 20.0)) == 6000


def plain_waypoints(speed: list[float]) -> list[int]:
    """Slow stretches beside the highest speed so far, and in each the rest, or the slowest row."""
    found: set[int] = set()
    highest, stretch = 0.0, []
    for k, v in enumerate([*speed, np.inf]):
        highest = max(highest, v)
        if v <= 1e-4 * highest and k < len(speed):
            stretch.append((v, k, v <= 1e-9 * highest))
        elif stretch:
            resting = [row for _, row, rests in stretch if rests]
            found |= {resting[0], resting[-1]} if resting else {min(stretch)[1]}
            stretch = []
    return sorted(found)


SPEEDS = st.sampled_from([0.0, 0.0, 1e-12, 5e-10, 1e-6, 2e-5, 9e-5, 0.5, 1.0, 3.0])


@given(st.lists(SPEEDS, max_size=60), st.lists(st.integers(0, 60), max_size=5))
def test_waypoints_are_those_of_a_plain_loop_in_any_parts(
    speed: list[float], cuts: list[int]
) -> None:
    rows = np.zeros((len(speed), 3, 2))
    rows[:, 1, 1] = np.negative(speed)
    waypoints = Waypoints()
    edges = [0, *sorted(min(cut, len(speed)) for cut in cuts), len(speed)]
    for start, stop in itertools.pairwise(edges):
        waypoints.add(rows[start:stop])
    assert waypoints.found().tolist() == plain_waypoints(speed)
    assert waypoints.rows == len(speed)
    assert waypoints.highest == max(speed, default=0.0)


def test_the_band_is_the_documented_one() -> None:
    assert BAND == 1e-5
