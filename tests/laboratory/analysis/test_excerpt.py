"""Parts of a flight by time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot.analysis import analyze, excerpt
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError


@pytest.fixture(scope="module")
def log() -> FlightLog:
    return simulate(Flight(resolve(FlightPlan(duration=0.3))))


@given(st.integers(0, 600), st.integers(0, 600), st.integers(0, 600))
def test_parts_add_up_to_the_whole(log: FlightLog, a: int, b: int, c: int) -> None:
    low, middle, high = sorted((a, b, c))
    if low == middle or middle == high:
        return
    first, second = (
        excerpt(log, low * 5e-4, middle * 5e-4),
        excerpt(log, middle * 5e-4, high * 5e-4),
    )
    assert (first.first_tick, first.ticks) == (low, middle - low)
    assert (second.first_tick, second.ticks) == (middle, high - middle)
    joined = np.concatenate([first.quaternion, second.quaternion])
    np.testing.assert_array_equal(joined, log.quaternion[low:high])
    again = excerpt(excerpt(log, low * 5e-4, high * 5e-4), middle * 5e-4, None)
    np.testing.assert_array_equal(again.quaternion, second.quaternion)


def test_without_times_it_is_the_flight(log: FlightLog) -> None:
    assert excerpt(log, None, None) is log


def test_the_report_is_of_the_excerpt(log: FlightLog) -> None:
    report = analyze(excerpt(log, 0.1, 0.2))
    assert (report["from_s"], report["to_s"], report["ticks"]) == (0.1, 0.2, 200)
    assert report["duration_s"] == 0.1
    assert report["maxima"] != analyze(log)["maxima"]


def test_unanswered_ticks_are_those_of_the_excerpt() -> None:
    log = simulate(Flight(resolve(FlightPlan(duration=0.1))))
    assert log.commanded_torque is not None
    log.commanded_torque[[3, 150, 151]] = np.nan
    log.unanswered = 3
    assert excerpt(log, 0.05, None).unanswered == 2
    assert excerpt(log, None, 0.05).unanswered == 1


@pytest.mark.parametrize(
    ("from_s", "to_s", "text"),
    [
        (0.2, 0.1, "--from 0.2 --to 0.1: the start must come before the end"),
        (0.1, 0.1, "the start must come before the end"),
        (-1.0, None, "--from -1: outside the flight, which lasts from 0 to 0.3 s"),
        (None, 0.31, "--to 0.31: outside the flight"),
        (0.3, None, "--from 0.3: outside the flight"),
        (None, 0.0, "--to 0: outside the flight"),
        (float("nan"), None, "outside the flight"),
        (0.1001, 0.1002, "no tick lies between"),
    ],
)
def test_wrong_times_are_named(
    log: FlightLog, from_s: float | None, to_s: float | None, text: str
) -> None:
    with pytest.raises(InputError, match=text):
        excerpt(log, from_s, to_s)
