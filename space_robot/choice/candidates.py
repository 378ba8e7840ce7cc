"""Candidates: one gain set a law, flown with many draws of what no law knows; ranks and reasons."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array

from ..analysis.words import Metrics, limit_cycles, with_statistic
from ..campaign.row.fly import RowFlyer
from ..campaign.row.row import Task, Value
from ..campaign.study import Study
from ..campaign.verdicts.laws import PairedComparison, compare, holm
from ..flight.batch import fly_in_lanes
from ..processes.executor import run_all
from .criteria import CRITERIA, Criterion, is_error
from .search_space import GainPoint
from .trials import HELD, LATENCY, Score

OFTEN = 0.1
"""A law is out if a larger share of its flights has a limit cycle, or a joint beyond its effort."""
MOST_SATURATION = 0.05
"""Largest median share of ticks with a wheel at its limit."""
GROUP = 8
"""Flights that a process takes at a time."""
CONFIRMING = 3
"""Factor on the draws in which the best law is checked; few draws miss rare limit cycles."""


class Candidate(NamedTuple):
    """The gain set with which a law takes part."""

    law: str
    controller: str
    """The law as an option of a scenario, such as ``file.py:Class``."""
    gains: GainPoint
    score: Score
    """Of its trials."""
    folder: str
    """Its gain files."""
    allowed: Mapping[str, float] = {}
    """Ripple allowed, by torque, N m or N: a limit cycle with less does not count."""


@dataclass(frozen=True)
class FlownCandidate:
    """A candidate and its flights."""

    candidate: Candidate
    flights: list[dict[str, float]]
    """Metrics of each run; empty if the flight ended early."""

    @property
    def law(self) -> str:
        """Name of the law."""
        return self.candidate.law

    def values(self, function: Callable[[Metrics], float]) -> Array:
        """Return a number of each run (N,), infinite if the flight ended early."""
        return np.array([function(flight) if flight else math.inf for flight in self.flights])

    def median(self, function: Callable[[Metrics], float]) -> float:
        """Return the median of a number over the runs."""
        return float(np.median(self.values(function)))

    @property
    def rms(self) -> dict[str, float]:
        """Median RMS errors over the runs that were flown."""
        flown = [flight for flight in self.flights if flight]
        errors = [name for name in flown[0] if is_error(name)] if flown else []
        return {
            name.removesuffix(".rms"): float(np.median([flight[name] for flight in flown]))
            for name in errors
        }

    @property
    def reason(self) -> str:
        """Why the candidate is out, in a few words; empty if it is not."""
        count = len(self.flights)
        if ended := sum(not flight for flight in self.flights):
            return f"diverged in {ended} of {count} flights"
        cycles = [
            text for flight in self.flights for text in limit_cycles(flight, self.candidate.allowed)
        ]
        if len(cycles) > OFTEN * count:
            return f"{cycles[0]} (in {len(cycles)} of {count} flights)"
        beyond = sum(any(with_statistic(f, "beyond_effort").values()) for f in self.flights)
        if beyond > OFTEN * count:
            return f"joints beyond their limits of effort in {beyond} of {count} flights"
        share = float(np.median([flight.get("wheels.saturation", 0.0) for flight in self.flights]))
        if share > MOST_SATURATION:
            return f"wheels at their limit in {share:.0%} of the ticks"
        for name in with_statistic(self.flights[0], "standing"):
            shares = [flight.get(f"{name}.standing", 0.0) for flight in self.flights]
            if (held := float(np.median(shares))) > HELD:
                return f"{name} held by friction on {held:.0%} of its way"
        return ""


def fly_candidates(
    study: Study,
    candidates: Sequence[Candidate],
    criterion: str,
    runs: int,
    seed: int,
    workers: int,
    progress: Callable[[int], Callable[[], None]] = lambda total: lambda: None,
) -> list[FlownCandidate]:
    """Fly every candidate with the same draws.

    Args:
        study: scenario and distributions; its laws do not count.
        candidates: of different laws.
        criterion: name of one of `CRITERIA`.
        runs: draws.
        seed: of the draws.
        workers: see `run_many`.
        progress: see `run_all`.
    """
    laws = [f"{c.controller}={c.folder}" for c in candidates]
    flyer = RowFlyer.of(study.model_copy(update={"laws": laws}), seed, runs)
    runs_of: dict[Value, list[int]] = {}  # only flights of one latency share lanes
    for run in range(runs):
        runs_of.setdefault(flyer.draws.values(run).get(LATENCY, 0), []).append(run)
    groups = [same[k : k + GROUP] for same in runs_of.values() for k in range(0, len(same), GROUP)]
    tasks = [tuple(Task(run, law) for run in group) for group in groups for law in laws]
    flown = run_all(partial(_fly, flyer, criterion), tasks, workers, progress)
    by_task = dict(zip(chain(*tasks), chain(*flown), strict=True))
    return [
        FlownCandidate(candidate, [by_task[Task(run, law)] for run in range(runs)])
        for candidate, law in zip(candidates, laws, strict=True)
    ]


def ranked(flown: Sequence[FlownCandidate], criterion: Criterion) -> list[FlownCandidate]:
    """Return the candidates that are not out, the best one first."""
    able = [each for each in flown if not each.reason]
    least = min((each.median(criterion.error) for each in able), default=math.inf)
    near = [each for each in able if each.median(criterion.error) <= criterion.near * least]
    return sorted(near, key=lambda each: each.median(criterion.value))


def select(
    waiting: Mapping[str, Iterator[Candidate]],
    fly: Callable[[Sequence[Candidate], int, int], Sequence[FlownCandidate]],
    criterion: Criterion,
    runs: int,
    seed: int,
) -> tuple[dict[str, FlownCandidate], list[FlownCandidate]]:
    """Fly candidates of all laws, with the next gains of a law while it is out.

    The best of those that are not out must pass `CONFIRMING` times as many new draws, too.

    Args:
        waiting: candidates of each law, the preferred one first.
        fly: flies candidates with a number of draws from a seed.
        criterion: of the ranks.
        runs: draws.
        seed: of the draws.

    Returns:
        What was flown last of each law, and those that are not out, the best one first.
    """
    by_law: dict[str, FlownCandidate] = {}
    due = list(waiting)
    while True:
        if candidates := [each for law in due if (each := next(waiting[law], None))]:
            by_law |= {each.law: each for each in fly(candidates, runs, seed)}
        if due := [each.law for each in candidates if by_law[each.law].reason]:
            continue
        if not (order := ranked(list(by_law.values()), criterion)):
            return by_law, []
        (first,) = fly([order[0].candidate], CONFIRMING * runs, seed + 1)
        if not first.reason:
            return by_law, order
        by_law[first.law], due = first, [first.law]


def comparisons(order: Sequence[FlownCandidate], criterion: Criterion) -> list[PairedComparison]:
    """Compare the first candidate with each of the others over the same draws, by Holm's method."""
    first, *others = order
    own = first.values(criterion.value)
    compared = [
        compare(own, other.values(criterion.value), law=first.law, other=other.law)
        for other in others
    ]
    p_values = holm([each.p_better for each in compared])
    return [replace(c, p_better=p) for c, p in zip(compared, p_values, strict=True)]


def _fly(flyer: RowFlyer, criterion: str, tasks: Sequence[Task]) -> list[dict[str, float]]:
    flights = [flyer.draws.flight(task.run, task.law) for task in tasks]
    return [
        {} if flown.ending.error else CRITERIA[criterion].of(flown.log)
        for flown in fly_in_lanes(flights)
    ]
