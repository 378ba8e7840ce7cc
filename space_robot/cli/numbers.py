"""Types of options with numeric values."""

from __future__ import annotations

import math
from typing import Any

import click


class FiniteRange(click.FloatRange):
    """A `click.FloatRange` that refuses nan and infinities."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Convert a text to a number."""
        number: float = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


class NumberList(click.ParamType[list[float]]):
    """Finite numbers separated by commas."""

    name = "numbers"

    def __init__(self, *counts: int) -> None:
        """Store how many numbers there may be; none: any."""
        self.counts = counts

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[float]:
        """Convert a text to numbers."""
        try:
            numbers = [float(word) for word in value.split(",")]
        except ValueError:
            numbers = [math.nan]
        if not all(map(math.isfinite, numbers)) or len(numbers) not in (
            self.counts or [len(numbers)]
        ):
            what = f"{' or '.join(map(str, self.counts))} numbers".lstrip()
            self.fail(f"{what} separated by commas were expected, got {value!r}", param, ctx)
        return numbers
