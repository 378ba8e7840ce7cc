"""Arguments of public functions: what is taken, and the one line about what is not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from space_robot_msgs_py.config.arguments import as_numbers, as_path, as_whole_number, path_text
from space_robot_msgs_py.errors import InputError


def test_a_path_is_text_or_a_path() -> None:
    for value in ("./one", Path("one")):
        assert as_path(value, "bag") == Path("one")
    assert path_text("./one", "bag") == "./one"
    for other in (1, None, b"one", ["one"]):
        for read in (as_path, path_text):
            with pytest.raises(InputError) as caught:
                read(other, "bag")
            assert str(caught.value) == f"bag: a path was expected, got {other!r}"


@pytest.mark.parametrize(
    "value", [1, 2.5, [1, 2], ((1, 2.0), (3, 4)), np.arange(3, dtype=np.uint8)]
)
def test_numbers_are_an_array_of_their_form(value: Any) -> None:
    numbers = as_numbers(value, "action")
    assert numbers.dtype == np.float64
    assert numbers.shape == np.shape(value)
    assert numbers.tolist() == np.array(value).tolist()


def test_numbers_that_are_taken_are_a_copy() -> None:
    own = np.zeros(3)
    as_numbers(own, "action")[:] = 1.0
    assert not own.any()


@pytest.mark.parametrize("value", [None, "1", [True], [1j], [[1.0], [1.0, 2.0]], [None], {}])
def test_what_is_no_numbers_is_refused(value: Any) -> None:
    with pytest.raises(InputError, match=r"^action: numbers were expected, got "):
        as_numbers(value, "action")


def test_a_whole_number_is_in_its_range_with_both_ends() -> None:
    for value in (2, np.int64(3), 5):
        assert as_whole_number(value, "ticks", 2, 5) == value
    assert as_whole_number(10**30, "ticks", 2) == 10**30
    for value, most, allowed in ((1, 5, "2 to 5"), (6, 5, "2 to 5"), (1, None, "2 or more")):
        with pytest.raises(InputError) as caught:
            as_whole_number(value, "ticks", 2, most)
        assert str(caught.value) == f"ticks: {allowed} is allowed, got {value}"
    for other in (True, np.True_, 3.0, "3", None):
        with pytest.raises(InputError, match=r"^ticks: a whole number was expected, got "):
            as_whole_number(other, "ticks", 0)
