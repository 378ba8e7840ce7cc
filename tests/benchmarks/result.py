"""What was measured: samples, what they stand beside, what was asked."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Units of time, s."""


@dataclass(frozen=True)
class Beside:
    """A competitor measured in the same run, or a constant such as real time."""

    name: str
    samples: tuple[float, ...]
    """In the unit of the result; as many as its own, or one for a constant."""


@dataclass(frozen=True)
class Target:
    """What is asked of a result."""

    limit: float
    aim: float | None = None
    """What would be better still."""
    of: Literal["median", "ratio"] = "median"
    """The figure it is asked of."""


@dataclass(frozen=True)
class Result:
    """One row of a section."""

    name: str
    unit: str
    samples: tuple[float, ...]
    """One a repetition."""
    beside: Beside | None = None
    target: Target | None = None
    better: Literal["less", "more"] = "less"
    """Which values are the better ones."""
    note: str = ""
    is_condition: bool = False
    """Without it the other rows mean nothing: a miss ends the command with exit code 1."""

    @classmethod
    def timed(
        cls,
        name: str,
        unit: str,
        seconds: Sequence[float],
        beside: tuple[str, Sequence[float]] | None = None,
        target: Target | None = None,
        note: str = "",
    ) -> Result:
        """Of times in seconds, as `interleave` returns them; ``target`` is in ``unit``."""
        other = Beside(beside[0], _scaled(beside[1], unit)) if beside else None
        return cls(name, unit, _scaled(seconds, unit), other, target, note=note)

    @property
    def median(self) -> float:
        """Of the samples."""
        return statistics.median(self.samples)

    @property
    def spread(self) -> tuple[float, float]:
        """Smallest and largest sample."""
        return min(self.samples), max(self.samples)

    @property
    def median_beside(self) -> float | None:
        """Of the competitor's samples."""
        return statistics.median(self.beside.samples) if self.beside else None

    @property
    def ratios(self) -> tuple[float, ...]:
        """How many times better than the competitor, repetition by repetition."""
        if self.beside is None:
            return ()
        others = self.beside.samples
        if len(others) == 1:
            others *= len(self.samples)
        pairs = zip(self.samples, others, strict=True)
        if self.better == "less":
            return tuple(other / own for own, other in pairs)
        return tuple(own / other for own, other in pairs)

    @property
    def ratio(self) -> float | None:
        """Median of `ratios`."""
        return statistics.median(self.ratios) if self.beside else None

    @property
    def reached(self) -> bool | None:
        """Whether what is asked was reached; None if nothing is."""
        return None if self.target is None else self._meets(self.target.limit)

    @property
    def reached_aim(self) -> bool | None:
        """Whether the aim was reached; None if there is none."""
        if self.target is None or self.target.aim is None:
            return None
        return self._meets(self.target.aim)

    @property
    def relation(self) -> str:
        """How the figure must stand to the limit."""
        is_upper = self.target is not None and self.target.of == "median" and self.better == "less"
        return "<=" if is_upper else ">="

    def _meets(self, limit: float) -> bool:
        assert self.target is not None
        value = self.median if self.target.of == "median" else self.ratio
        if value is None:
            raise ValueError(f"{self.name}: a ratio is asked of what stands beside nothing")
        return value <= limit if self.relation == "<=" else value >= limit

    def record(self) -> dict[str, Any]:
        """As JSON holds it."""
        everything = {"this": self.samples}
        if self.beside:
            everything[self.beside.name] = self.beside.samples
        asked = None
        if self.target:
            asked = {
                "of": self.target.of,
                "relation": self.relation,
                "limit": self.target.limit,
                "aim": self.target.aim,
            }
        return {
            "name": self.name,
            "unit": self.unit,
            "better": self.better,
            "median": self.median,
            "spread": list(self.spread),
            "beside": self.beside.name if self.beside else None,
            "median_beside": self.median_beside,
            "ratio": self.ratio,
            "ratio_spread": [min(self.ratios), max(self.ratios)] if self.beside else None,
            "asked": asked,
            "reached": self.reached,
            "reached_aim": self.reached_aim,
            "is_condition": self.is_condition,
            "note": self.note,
            "samples": {name: list(samples) for name, samples in everything.items()},
        }


def _scaled(seconds: Sequence[float], unit: str) -> tuple[float, ...]:
    return tuple(value / UNITS[unit] for value in seconds)
