"""The names that an error suggests, and how many it lists."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot_msgs_py.config.choices import MOST_LISTED, choices, nearest
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError

NAMES = st.text("abcdefgh_", min_size=6, max_size=12)


@pytest.mark.parametrize("meant", ["noise_gyro", "hold_ticks", "torque_scale", "tde_stc"])
def test_one_slip_of_the_finger_suggests_the_name_that_was_meant(meant: str) -> None:
    names = ["attitude", "bias_gyro", "clock_decimation", "ctc", "drop_state", meant, "Wheel_1"]
    for k in range(len(meant)):
        for slip in (meant[:k] + meant[k + 1 :], f"{meant[:k]}z{meant[k:]}", meant.upper()):
            assert nearest(slip, names)[0] == meant
    assert nearest("wheel_1", names) == ["Wheel_1"]
    assert nearest("qqqq", names) == []
    assert nearest("drop", names) == ["drop_state"], "a part of it"


@settings(max_examples=20)
@given(st.lists(NAMES, unique=True, max_size=60), st.text(max_size=200), st.booleans())
def test_an_error_is_one_line_of_bounded_length(
    names: list[str], name: str, is_listed: bool
) -> None:
    text = choices(name, names, listing="--all" if is_listed else "")
    assert len(text) < 400
    assert text.isprintable()
    if len(names) > MOST_LISTED:
        assert f"{len(names)}" in text
    else:
        assert all(other in text for other in names)


@pytest.mark.parametrize("count", [1, 10_000])
def test_the_longest_names_cost_no_time(count: int) -> None:
    with pytest.raises(InputError, match="unknown link"):
        one_of("a" * 100_000, [f"{k}_{'a' * 1000}" for k in range(count)], "link")


def test_as_many_names_as_may_be_listed_are_listed() -> None:
    names = [f"name_{k}" for k in range(MOST_LISTED + 1)]
    for listing in ("", "--all"):
        assert choices("x", names[:-1], listing=listing) == f"choose one of {', '.join(names[:-1])}"
    assert names[-1] not in choices("x", names)


def test_a_part_of_a_name_names_it_from_three_letters_on() -> None:
    names = ["thrusters_and_more", "wheels_and_thrusters", "something_else"]
    assert nearest("ust", names) == names[:2]
    assert nearest("us", names) == []
