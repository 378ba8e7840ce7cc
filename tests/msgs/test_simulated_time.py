"""Times of a flight: which are allowed, how they are written, and the tick that they fall on."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.simulated_time import LATEST_S, check_time, shortest, tick_from


def test_a_time_is_from_zero_to_the_latest() -> None:
    assert LATEST_S / 10e-6 < 2**63, "of the shortest period, too, its tick fits in 64 bits"
    for seconds in (0.0, LATEST_S):
        check_time(seconds)
    for seconds in (-1e-9, math.nextafter(LATEST_S, math.inf), math.inf, math.nan):
        with pytest.raises(InputError, match=r"^END must be from 0 to 1e\+09 s, got "):
            check_time(seconds, "END")
    with pytest.raises(InputError, match=r"^T must be .*, got -1$"):
        check_time(-1.0)


@given(st.floats(0.0, LATEST_S))
def test_the_shortest_text_is_the_same_number(seconds: float) -> None:
    assert float(shortest(seconds)) == seconds
    assert not shortest(seconds).endswith(".0")


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "0"), (10.0, "10"), (0.1, "0.1"), (1e-7, "1e-07"), (100.05, "100.05")],
)
def test_times_as_they_are_written(seconds: float, text: str) -> None:
    assert shortest(seconds) == text


@given(st.integers(0, 10**8), st.integers(20, 100_000).map(lambda us: us * 1e-6))
def test_the_time_of_a_tick_falls_on_it_and_a_little_more_on_the_next(
    tick: int, period: float
) -> None:
    assert tick_from(tick * period, period) == tick
    exact = (tick + Fraction(1, 1000)) * Fraction(period)
    assert tick_from(float(exact), period) == tick + 1
    assert tick_from(float((tick + Fraction(1, 10**8)) * Fraction(period)), period) == tick


def test_times_beyond_all_ticks() -> None:
    assert tick_from(1e308, 1e-3) == math.inf
    assert tick_from(math.inf, 1e-3) == math.inf
