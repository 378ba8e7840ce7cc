"""Requirements: met, not met, undecided or not measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .design import independent_rows
from .share_test import MOST_RUNS, FixedSample, Sequential, ShareTest, first, log_evidence
from .shares import Interval
from .values import NOT_OF_THE_LAW, ended, laws_of, measured, of_law, parts, turned

if TYPE_CHECKING:
    from pandas import DataFrame

    from ..study import Requirement, Study

Array = NDArray[np.float64]
Word = Literal["met", "not met", "undecided", "not measured"]


@dataclass(frozen=True)
class Verdict:
    """What the runs of a law say about a requirement.

    A word that is false comes with a probability of at most 1 - the requirement's confidence.
    """

    requirement: str
    law: str
    point: str
    """Of the campaign's grid; empty if it has none."""
    word: Word
    runs: int
    failures: int
    """Runs that miss the requirement, those that did not come to their end among them."""
    not_ended: int
    """Of the failures: flights that did not come to their end."""
    not_of_the_law: int
    """Of those: killed, out of time or refused."""
    not_measured: int
    """Runs that came to their end without the number that is required.

    They speak against every verdict: as failures against "met", as successes against "not met".
    """
    limits: Interval
    """The share of cases that meet it is at least and at most this: each at the confidence."""
    bound: float | None
    """The metric is no worse than this in the demanded share of the cases, at the confidence.

    Infinite: too many flights failed. None: there are too few runs to say.
    """
    needed_without_failure: int | None
    """Further runs that would show it met if none of them failed; None of a fixed sample."""
    projected_decision: ProjectedDecision | None
    """When it would be decided if failures go on as they did.

    None if it is decided, if it cannot be said, and of a fixed sample.
    """

    @property
    def met(self) -> int:
        """The number of runs that met it."""
        return self.runs - self.failures - self.not_measured

    @property
    def share(self) -> float:
        """The share of the runs that met it; NaN of no runs."""
        return self.met / self.runs if self.runs else float("nan")


def verdicts(table: DataFrame, study: Study, runs: int, grid: Sequence[str] = ()) -> list[Verdict]:
    """Judge every law by every requirement, at every point of the grid.

    Args:
        table: rows of the campaign; ``require.<name>`` are the requirements' columns.
        study: its file.
        runs: of the campaign. If their number is fixed, nothing is judged before all are flown.
        grid: names of the variables that are grids.
    """
    rows = independent_rows(table, study.design)
    test: type[ShareTest] | None = Sequential
    if study.has_fixed_runs:
        test = FixedSample if len(table) >= runs * len(study.laws) else None
    return [
        verdict(name, demand, of_law(part.table, law), test, law, part.point)
        for name, demand in study.require.items()
        for part in parts(rows, grid)
        for law in laws_of(part.table)
    ]


def verdict(
    name: str,
    demand: Requirement,
    rows: DataFrame,
    kind: type[ShareTest] | None = Sequential,
    law: str = "",
    point: str = "",
) -> Verdict:
    """Judge the rows of one law by one requirement.

    Args:
        name: of the requirement.
        demand: what it asks for.
        rows: one a run.
        kind: of test; None: of a fixed sample that is not complete, which shows nothing yet.
        law: for the verdict.
        point: for the verdict.
    """
    sign, column = demand.sign, f"require.{name}"
    badness = measured(turned(rows, column, sign), column)
    has_ended = ended(rows)
    is_unmeasured = has_ended & np.isinf(badness)
    runs, not_measured = len(badness), int(np.sum(is_unmeasured))
    failures = int(np.sum(~(badness < sign * demand.bound) & ~is_unmeasured))
    word: Word = "not measured" if not_measured else "undecided"
    limits, bound, needed, projected = Interval(0.0, 1.0), None, None, None
    if kind is not None and runs:
        test = kind(demand.share, demand.confidence)
        if test.is_met(failures + not_measured, runs):
            word = "met"
        elif test.is_missed(failures, runs):
            word = "not met"
        low, high = (test.limits(f, runs) for f in (failures + not_measured, failures))
        limits = Interval(low.low, high.high)
        rank = test.bound_rank(runs)
        bound = None if rank is None else sign * float(np.sort(badness)[rank - 1])
    if kind is Sequential:
        sequential = Sequential(demand.share, demand.confidence)
        total = sequential.runs_needed(failures + not_measured)
        needed = None if total is None else max(0, total - runs)
        if runs and word == "undecided":
            projected = projected_decision(sequential, failures, runs)
    return Verdict(
        name,
        law,
        point,
        word,
        runs,
        failures,
        int(np.sum(~has_ended)),
        int(rows["outcome"].isin(NOT_OF_THE_LAW).sum()),
        not_measured,
        limits,
        bound,
        needed,
        projected,
    )


def family_error(study: Study, verdicts: list[Verdict]) -> float:
    """Return the largest probability that any of some verdicts is false (Bonferroni)."""
    return min(1.0, sum(1.0 - study.require[v.requirement].confidence for v in verdicts))


_STEPS = 32
"""That are looked at together first; then twice as many, and so on."""


class ProjectedDecision(NamedTuple):
    """The number of runs after which a requirement would be decided, and how."""

    runs: int
    """In all."""
    met: bool


def projected_decision(test: Sequential, failures: int, runs: int) -> ProjectedDecision | None:
    """Return the first decision if failures go on at the rate seen.

    After n runs there are then ``failures / runs * n`` failures, rounded to whole ones against the
    decision. So the number of failures rises in steps, and what is decided just before a step may
    be open after it: the first decision is searched step by step.

    Args:
        test: of the requirement.
        failures: seen so far.
        runs: flown so far, at least one.

    Returns:
        None: failures are exactly as frequent as allowed, or it takes more than `MOST_RUNS` runs.
    """
    rate, allowed = failures / runs, 1.0 - test.share
    if rate == allowed:
        return None
    met = rate < allowed
    if failures == 0:
        needed = test.runs_needed(0)
        return None if needed is None else ProjectedDecision(max(runs, needed), True)
    level = -np.log1p(-test.confidence)

    def may_be_decided(n: int) -> bool:
        """Return True if it is decided without rounding; with rounding it is no sooner."""
        events, share = (rate * n, allowed) if met else ((1.0 - rate) * n, test.share)
        return bool(log_evidence(events, n, share) >= level - 1e-6)

    start = first(may_be_decided, runs, MOST_RUNS + 1)
    step, count = max(failures, failures * start // runs), _STEPS
    while step * runs // failures <= MOST_RUNS:
        steps = np.arange(step, step + count)
        # failures stay whole and alike from one end to the next: the last run before a step speaks
        # most for "met", the first run of a step most for "not met"
        ends = steps * runs // failures if met else -(-steps * runs // failures)
        decided = test.is_met(steps, ends) if met else test.is_missed(steps, ends)
        decided &= ends >= runs
        if decided.any():
            index = int(np.argmax(decided))
            end = int(ends[index])
            if met:  # with as many failures fewer runs may do
                end = max(runs, test.runs_needed(int(steps[index])) or end)
            return ProjectedDecision(end, met) if end <= MOST_RUNS else None
        step, count = step + count, 2 * count
    return None
