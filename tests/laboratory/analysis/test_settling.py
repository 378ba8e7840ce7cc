"""Waypoints and settling times of hand-made references and errors, against plain loops."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from space_robot.analysis import excerpt
from space_robot.analysis.settling import Settling
from space_robot.analysis.waypoints import Waypoints, junction_ticks, waypoint_ticks
from space_robot.flight.flown_log import empty_log
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_msgs_py.bag.blocks import blocks_of
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase

PERIOD = 0.0005
SPEEDS = st.sampled_from([0.0, 0.0, 1e-12, 5e-10, 1e-6, 2e-5, 9e-5, 0.5, 1.0, 3.0])


def log_with(speed: np.ndarray, first_tick: int = 0) -> FlightLog:
    """One joint with these desired speeds (N,)."""
    log = FlightLog.allocate(len(speed), ("j",), Timebase(500_000))
    log.first_tick = first_tick
    log.reference_joints[:], log.reference_joints[:, 1, 0] = 0.0, speed
    return log


def planned_log(duration: float) -> FlightLog:
    """The paper's mission, whose waypoints are at 0, 15 and 30 s."""
    return empty_log(Flight(resolve(FlightPlan(duration=duration))))


@given(
    arrays(np.float64, (300, 4), elements=st.floats(-2.0, 2.0)),
    st.integers(0, 100),
    st.integers(0, 300),
    st.sets(st.integers(0, 299), max_size=40),
    st.integers(0, 50),
)
def test_after_it_the_error_stays_in_the_band_and_before_it_does_not(
    error: np.ndarray, start: int, calm_from: int, loud: set[int], first_tick: int
) -> None:
    """Of the base's and the joint's column alike; the largest in size of the axes counts."""
    error[calm_from:] *= 0.4
    error[sorted(loud), 2] = -1.5
    speed = np.ones(300)
    speed[start] = 0.0
    log = log_with(speed, first_tick)
    metric = Settling(log, band=1.0)
    metric.add(log, error)
    found = metric.result()
    assert found["band"] == 1.0
    assert found["after_s"] == pytest.approx((first_tick + start) * PERIOD)
    for name, axes in (("attitude", slice(0, 3)), ("joints_1_1", slice(3, 4))):
        size = np.max(np.abs(error[:, axes]), axis=1)
        rows = [k for k in range(start, 300) if np.all(size[k:] <= 1.0)]
        expected = (rows[0] - start) * PERIOD if rows else None
        assert found["settled_s"][name] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("log", "expected"),
    [
        (planned_log(30.0), 30_000),
        (planned_log(31.0), 60_000),
        (planned_log(14.0), 0),
        *((log_with(np.array([0.0, 0.0] + [1.0] * n)), k) for n, k in ((199, 1), (198, 0))),
        (log_with(np.array([0.0, 0.0] + [1.0] * 197)), None),
        (log_with(np.ones(300)), None),
    ],
)
def test_the_last_waypoint_has_flight_after_it(log: FlightLog, expected: int | None) -> None:
    metric = Settling(log)
    for block in blocks_of(log):
        metric.add(block, np.zeros((block.ticks, log.axes)))
    assert metric.last_waypoint == expected
    if expected is None:
        with pytest.raises(InputError, match="does not come to rest"):
            metric.result()
    else:
        assert metric.result()["band"] == 1e-5  # as documented


@given(st.lists(SPEEDS, max_size=60), st.integers(0, 60))
def test_waypoints_are_those_of_a_plain_loop(speed: list[float], first: int) -> None:
    """Slow stretches beside the highest speed so far, and in each the rest, or the slowest row."""
    rows = np.zeros((len(speed), 3, 2))
    rows[:, 1, 1] = np.negative(speed)
    waypoints = Waypoints()
    waypoints.add(rows[:first])
    waypoints.add(rows[first:])
    expected: set[int] = set()
    highest, stretch = 0.0, []
    for k, v in enumerate([*speed, np.inf]):
        highest = max(highest, v)
        if v <= 1e-4 * highest and k < len(speed):
            stretch.append((v, k, v <= 1e-9 * highest))
        elif stretch:
            resting = [row for _, row, rests in stretch if rests]
            expected |= {resting[0], resting[-1]} if resting else {min(stretch)[1]}
            stretch = []
    assert waypoints.found().tolist() == sorted(expected)
    assert waypoints.rows == len(speed)
    assert waypoints.highest == max(speed, default=0.0)


RESTS = [*[0.0] * 5, *[0.2] * 10, *[0.0] * 7, *[0.1] * 10]
UNKNOWN = [*[0.0] * 3, *[1.0] * 12, np.nan, *[1.0] * 4]
"""A reference is missing: no rest."""


@pytest.mark.parametrize(
    ("log", "ticks", "junctions"),
    [
        (planned_log(30.0), [0, 30_000, 59_999], [30_000]),
        (planned_log(1.0), [0], []),  # cut short
        (log_with(1e-3 * np.sin(np.pi * np.linspace(0, 2, 201)) ** 4), [0, 100, 200], [100]),
        (log_with(np.array(RESTS)), [0, 4, 15, 21], [4, 15, 21]),
        (log_with(np.zeros(20)), [0], []),
        (log_with(np.array(UNKNOWN)), [0, 2], [2]),
        (excerpt(planned_log(30.0), 5.0, 6.0), [], []),
    ],
)
def test_waypoints_and_junctions(log: FlightLog, ticks: list[int], junctions: list[int]) -> None:
    assert waypoint_ticks(log) == pytest.approx(ticks, abs=1)
    assert junction_ticks(log) == pytest.approx(junctions, abs=1)
