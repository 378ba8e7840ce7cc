"""Swaps as text, and what is said of bad ones."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_control.controller.swaps import Swap, parse_swaps
from space_robot_msgs_py.errors import InputError

PERIOD = 5e-4


@given(st.dictionaries(st.integers(0, 10**8), st.sampled_from(["ctc", "tde_stc"])), st.randoms())
def test_swaps_are_read_in_the_order_of_their_ticks(laws: dict[int, str], shuffler: object) -> None:
    """Each on the very tick that its time is the beginning of."""
    texts = [f"{tick * PERIOD!r}:{name}" for tick, name in laws.items()]
    shuffler.shuffle(texts)  # type: ignore[attr-defined]
    assert parse_swaps(texts, PERIOD) == [Swap(tick, laws[tick]) for tick in sorted(laws)]


def test_between_two_ticks_the_next_one_counts() -> None:
    assert parse_swaps(["0.00051:ctc"], PERIOD) == [Swap(2, "ctc")]


def test_empty_texts_are_no_swaps() -> None:
    """ROS has no empty list of strings."""
    assert parse_swaps(["", "  "], PERIOD) == []


def test_a_law_of_ones_own_keeps_its_colon() -> None:
    assert parse_swaps(["1: my_laws:Mine "], PERIOD) == [Swap(2000, "my_laws:Mine")]


@pytest.mark.parametrize("text", ["5", "5:", ":ctc", "x:ctc", "nan:ctc"])
def test_what_is_no_swap_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(InputError, match=rf"swap '{text}': T:LAW expected.*as in 5:tde_smc"):
        parse_swaps([text], PERIOD)


@pytest.mark.parametrize("time", ["-1", "inf", "1.1e9"])
def test_a_time_that_no_flight_has_is_refused(time: str) -> None:
    with pytest.raises(InputError, match=rf"swap '{time}:ctc': T must be from 0 to 1e\+09 s"):
        parse_swaps([f"{time}:ctc"], PERIOD)


def test_two_swaps_on_one_tick_are_refused() -> None:
    with pytest.raises(InputError, match="swaps to ctc and to tde_stc fall on tick 2000"):
        parse_swaps(["1:tde_stc", "0.9999999999:ctc"], PERIOD)


def test_a_law_there_is_not_is_refused_before_the_flight() -> None:
    with pytest.raises(InputError, match="nonesuch"):
        Flight(resolve(FlightPlan(swaps=["1:nonesuch"])))
