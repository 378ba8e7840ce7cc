"""Check of an inequality of the paper, ``value < limit``, with both numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple


class Check(NamedTuple):
    """An inequality ``value < limit``; NaN stands for an unknown number."""

    value: float
    limit: float
    applies: bool = True
    """False if an assumption of the limit does not hold: then the inequality is not applicable."""

    @property
    def holds(self) -> bool | None:
        """True if ``value < limit``; None if a number is unknown, or the limit not applicable."""
        if not self.applies:
            return None
        if math.isnan(self.value) or math.isnan(self.limit):
            return None
        return self.value < self.limit

    @property
    def verdict(self) -> str:
        """Result as text."""
        if not self.applies:
            return "not applicable"
        return {True: "holds", False: "fails", None: "open"}[self.holds]


def checks(values: Iterable[float], limits: Iterable[float]) -> tuple[Check, ...]:
    """Return one check per axis."""
    return tuple(
        Check(float(value), float(limit)) for value, limit in zip(values, limits, strict=True)
    )
