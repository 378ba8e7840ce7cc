"""Timing several things alternately in one run, so that what disturbs one disturbs all."""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Competitor = Callable[[int], object]
"""Does its work that many times over; the loop is the competitor's own, compiled if it can."""
Samples = tuple[float, ...]
UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Units of time, s."""


@dataclass(frozen=True)
class Row:
    """A figure, and what it stands beside."""

    name: str
    unit: str
    samples: Samples
    """One a repetition."""
    beside: str = ""
    """A competitor measured in the same run, or a constant such as real time."""
    others: Samples = ()
    """Samples of it; as many as its own, or one for a constant."""
    note: str = ""
    is_rate: bool = False
    """Whether more is better."""
    limit: float | None = None
    """A condition: what the median must be below (a rate: above), or other rows mean nothing."""

    @property
    def median(self) -> float:
        """Of the samples."""
        return statistics.median(self.samples)

    @property
    def median_beside(self) -> float:
        """Of the competitor's samples."""
        return statistics.median(self.others)

    @property
    def ratio(self) -> float:
        """How many times better than the competitor: median over the repetitions."""
        others = self.others * len(self.samples) if len(self.others) == 1 else self.others
        pairs = list(zip(self.samples, others, strict=True))
        return statistics.median(own / o if self.is_rate else o / own for own, o in pairs)

    @property
    def holds(self) -> bool | None:
        """Whether the condition holds; None if it is none."""
        if self.limit is None:
            return None
        return self.median >= self.limit if self.is_rate else self.median <= self.limit

    def record(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        samples = {"this": self.samples} | ({self.beside: self.others} if self.beside else {})
        return {
            "name": self.name,
            "unit": self.unit,
            "median": self.median,
            "spread": [min(self.samples), max(self.samples)],
            "beside": self.beside or None,
            "ratio": self.ratio if self.beside else None,
            "limit": self.limit,
            "holds": self.holds,
            "note": self.note,
            "samples": {name: list(values) for name, values in samples.items()},
        }


def timed(
    name: str,
    unit: str,
    seconds: Sequence[float],
    beside: tuple[str, Sequence[float]] = ("", ()),
    note: str = "",
) -> Row:
    """Return a row of times in seconds, as `Run.interleave` returns them."""
    own, others = (tuple(s / UNITS[unit] for s in samples) for samples in (seconds, beside[1]))
    return Row(name, unit, own, beside[0], others, note)


@dataclass(frozen=True)
class Run:
    """How long to measure."""

    short: bool = False
    """As little work as shows that it works; the times mean nothing."""
    repetitions: int | None = None
    """Batches of each competitor (None: as many as the section thinks fit)."""
    progress: Callable[[str], None] = lambda what: None
    """Told what is measured next."""

    def batches(self, usual: int = 15) -> int:
        """Return the repetitions of a section that usually makes ``usual``."""
        return self.repetitions or (2 if self.short else usual)

    def interleave(
        self, competitors: Mapping[str, Competitor], usual: int = 15, batch_s: float = 0.05
    ) -> dict[str, Samples]:
        """Time batches of all competitors in turn: A B C A B C ...

        Args:
            competitors: by name, in the order they run.
            usual: batches of each, unless the user says otherwise.
            batch_s: s that a batch lasts at least, as a warm-up foretells; 0: no warm-up, one loop.

        Returns:
            Seconds of one loop by competitor, one a repetition.
        """
        batch_s = min(batch_s, 1e-3) if self.short else batch_s
        loops = {name: _loops(run, batch_s) for name, run in competitors.items()}
        samples: dict[str, list[float]] = {name: [] for name in competitors}
        for _ in range(self.batches(usual)):
            for name, run in competitors.items():
                samples[name].append(_batch(run, loops[name]) / loops[name])
        return {name: tuple(times) for name, times in samples.items()}


def repeated(function: Callable[[], object]) -> Competitor:
    """Return a competitor whose loop is Python's: the call belongs to what is measured."""

    def run(loops: int) -> None:
        for _ in range(loops):
            function()

    return run


def _loops(run: Competitor, batch_s: float) -> int:
    """Return the loops that fill a batch."""
    if not batch_s:
        return 1
    loops, elapsed = 1, _batch(run, 1)
    if elapsed >= batch_s:
        elapsed = _batch(run, 1)  # it may have compiled before
    while elapsed < batch_s:
        factor = 1.1 * batch_s / elapsed if elapsed > 0.0 else 10.0
        loops = math.ceil(loops * min(max(factor, 1.2), 10.0))
        elapsed = _batch(run, loops)
    return loops


def _batch(run: Competitor, loops: int) -> float:
    """Time a batch without the garbage collector."""
    gc.collect(0)
    gc.disable()
    try:
        begin = time.perf_counter()
        run(loops)
        return time.perf_counter() - begin
    finally:
        gc.enable()
