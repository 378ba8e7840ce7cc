"""Timing several things alternately in one run, so that what disturbs one disturbs all."""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from .result import Target

Competitor = Callable[[int], object]
"""Does its work that many times over; the loop is the competitor's own, compiled if it can."""
Clock = Callable[[], float]


@dataclass(frozen=True)
class Options:
    """How long to measure."""

    short: bool = False
    """As little work as shows that it works; the times mean nothing."""
    repetitions: int | None = None
    """Batches of each competitor (None: as many as the section thinks fit)."""
    progress: Callable[[str], None] = lambda what: None
    """Told what is measured next."""
    plot: Path | None = None
    """File of the growth's picture."""

    @property
    def batch_s(self) -> float:
        """Seconds that a batch must last at least."""
        return 0.001 if self.short else 0.05

    def asked(self, target: Target) -> Target | None:
        """What is asked of a figure; nothing in a short run, whose figures mean nothing."""
        return None if self.short else target

    def batches(self, usual: int = 15) -> int:
        """Repetitions of a section that usually makes ``usual``."""
        return self.repetitions or (2 if self.short else usual)


def repeated(function: Callable[[], object]) -> Competitor:
    """A competitor whose loop is Python's: the call belongs to what is measured."""

    def run(loops: int) -> None:
        for _ in range(loops):
            function()

    return run


def interleave(
    competitors: Mapping[str, Competitor],
    repetitions: int,
    *,
    batch_s: float = 0.05,
    warm_up: bool = True,
    clock: Clock = time.perf_counter,
) -> dict[str, tuple[float, ...]]:
    """Time batches of all competitors in turn: A B C A B C ...

    Args:
        competitors: by name, in the order they run.
        repetitions: batches of each.
        batch_s: s that a batch lasts at least, as the warm-up foretells.
        warm_up: whether to run each competitor before, uncounted, and find the loops of its
            batch; without, a batch is one loop.
        clock: s.

    Returns:
        Seconds of one loop by competitor, one a repetition.
    """
    loops = {
        name: _loops(run, batch_s, clock) if warm_up else 1 for name, run in competitors.items()
    }
    samples: dict[str, list[float]] = {name: [] for name in competitors}
    for _ in range(repetitions):
        for name, run in competitors.items():
            samples[name].append(_batch(run, loops[name], clock) / loops[name])
    return {name: tuple(times) for name, times in samples.items()}


def _loops(run: Competitor, batch_s: float, clock: Clock) -> int:
    """Loops that fill a batch."""
    loops, first = 1, _batch(run, 1, clock)
    if first >= batch_s:
        first = _batch(run, 1, clock)  # it may have compiled before
    elapsed = first
    while elapsed < batch_s:
        factor = 1.1 * batch_s / elapsed if elapsed > 0.0 else 10.0
        loops = math.ceil(loops * min(max(factor, 1.2), 10.0))
        elapsed = _batch(run, loops, clock)
    return loops


def _batch(run: Competitor, loops: int, clock: Clock) -> float:
    with _no_garbage_collection():
        begin = clock()
        run(loops)
        return clock() - begin


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    enabled = gc.isenabled()
    gc.collect(0)
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
