"""Numbers of options: finite ones in a range."""

from __future__ import annotations

import click
import pytest

from space_robot.cli.numbers import FiniteRange


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "1e999", "x"])
def test_what_is_no_finite_number_is_refused(text: str) -> None:
    for kind in (FiniteRange(), FiniteRange(0.0, 0.5, min_open=True)):
        with pytest.raises(click.BadParameter):
            kind.convert(text, None, None)
    if text != "x":
        with pytest.raises(click.BadParameter) as caught:
            FiniteRange().convert(text, None, None)
        assert str(caught.value) == f"{text} is not a finite number."


@pytest.mark.parametrize("text", ["0", "0.51", "-1"])
def test_what_is_beyond_a_bound_is_refused(text: str) -> None:
    with pytest.raises(click.BadParameter, match="is not in the range"):
        FiniteRange(0.0, 0.5, min_open=True).convert(text, None, None)


def test_bounds_are_in_the_range_unless_they_are_open() -> None:
    assert FiniteRange(0.0, 0.5, min_open=True).convert("0.5", None, None) == 0.5
    assert FiniteRange(0.0, 0.5).convert("0", None, None) == 0.0
