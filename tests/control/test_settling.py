"""Settling times of hand-made errors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from space_robot_control.analysis import excerpt
from space_robot_control.analysis.settling import last_waypoint, settling_time
from space_robot_control.flight.plan import Flight, FlightPlan
from space_robot_control.flight.simulate import unflown

PERIOD = 0.0005


@given(arrays(np.float64, (50, 3), elements=st.floats(-2.0, 2.0)), st.integers(0, 49))
def test_after_it_the_error_stays_in_the_band_and_before_it_does_not(
    error: np.ndarray, start: int
) -> None:
    size = np.max(np.abs(error), axis=1)
    time = settling_time(error, start, PERIOD, band=1.0)
    if time is None:
        assert size[-1] > 1.0
        return
    row = start + round(time / PERIOD)
    assert np.all(size[row:] <= 1.0)
    assert row == start or size[row - 1] > 1.0


def test_of_a_decay_it_is_the_logarithm() -> None:
    time = np.arange(4000) * PERIOD
    error = np.exp(-time / 0.1)[:, np.newaxis]
    assert settling_time(error, 0, PERIOD, band=1e-3) == pytest.approx(
        0.1 * np.log(1e3), abs=PERIOD
    )


@pytest.mark.parametrize(
    ("duration", "expected"), [(30.0, 30_000), (31.0, 60_000), (14.0, 0), (0.5, 0), (0.05, None)]
)
def test_the_last_waypoint_has_flight_after_it(duration: float, expected: int | None) -> None:
    log = unflown(Flight(FlightPlan(duration=duration)))
    row = last_waypoint(log)
    if expected is None:
        assert row is None
    elif duration > 30.0:  # the arm rests from there on: both ends of the rest are waypoints
        assert row is not None
        assert row >= expected - 1
    else:
        assert row == expected


def test_an_excerpt_without_rest_has_none() -> None:
    log = unflown(Flight(FlightPlan(duration=30.0)))
    assert last_waypoint(excerpt(log, 5.0, 10.0)) is None
    assert last_waypoint(excerpt(log, 12.0, 20.0)) == 6000
