"""One inequality of the paper, checked: ``value < limit``, with both numbers kept."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple


class Check(NamedTuple):
    """An inequality: ``value`` stays below ``limit``; NaN stands for a number that is not known."""

    value: float
    limit: float
    applies: bool = True
    """False if what the limit presumes was not so: then the inequality says nothing."""

    @property
    def holds(self) -> bool | None:
        """Strictly below; None if a number is not known, or the limit does not apply."""
        if not self.applies:
            return None
        if math.isnan(self.value) or math.isnan(self.limit):
            return None
        return self.value < self.limit

    @property
    def verdict(self) -> str:
        """In a word or two."""
        if not self.applies:
            return "not applicable"
        return {True: "holds", False: "fails", None: "open"}[self.holds]


def checks(values: Iterable[float], limits: Iterable[float]) -> tuple[Check, ...]:
    """Make a check an axis."""
    return tuple(
        Check(float(value), float(limit)) for value, limit in zip(values, limits, strict=True)
    )
