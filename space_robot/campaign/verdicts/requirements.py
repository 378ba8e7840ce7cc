"""Verdicts on requirements: met, not met, undecided or not measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .rows import EXTERNAL, grid_points, independent_rows, is_complete, law_rows, laws_in, penalised
from .share_test import MOST_RUNS, FixedSample, Interval, Sequential, ShareTest, first, log_evidence

if TYPE_CHECKING:
    from pandas import DataFrame

    from ..study import Requirement, Study

Array = NDArray[np.float64]
Word = Literal["met", "not met", "undecided", "not measured"]


@dataclass(frozen=True)
class Verdict:
    """Verdict on a requirement for one law.

    It is false with a probability of at most 1 - the requirement's confidence.
    """

    requirement: str
    law: str
    point: str
    """Point of the campaign's grid; empty if there is no grid."""
    word: Word
    runs: int
    failures: int
    """Number of runs that miss the requirement, including those that ended early."""
    not_ended: int
    """Number of failures that ended early."""
    external: int
    """Number of these that the law may not have caused: killed, out of time or refused."""
    not_measured: int
    """Number of completed runs without a value of the metric.

    They count against every verdict: as failures for "met", as successes for "not met".
    """
    limits: Interval
    """One-sided confidence limits of the share of cases that meet the requirement."""
    bound: float | None
    """Confidence bound of the metric in the required share of the cases.

    Infinite: too many flights failed. None: there are too few runs.
    """
    needed_without_failure: int | None
    """Further runs needed for "met" if none of them fails; None for a fixed sample."""
    projected_decision: ProjectedDecision | None
    """Decision expected at the present rate of failures.

    None if decided already, if it cannot be predicted, and for a fixed sample.
    """

    @property
    def met(self) -> int:
        """Number of runs that met the requirement."""
        return self.runs - self.failures - self.not_measured

    @property
    def share(self) -> float:
        """Share of the runs that met the requirement; NaN without runs."""
        return self.met / self.runs if self.runs else float("nan")


def verdicts(table: DataFrame, study: Study, runs: int, grid: Sequence[str] = ()) -> list[Verdict]:
    """Return the verdict on every requirement, for every law and grid point.

    Args:
        table: rows of the campaign; ``require.<name>`` are the requirements' columns.
        study: its file.
        runs: of the campaign. A fixed number must be complete before anything is decided.
        grid: names of the grid variables.
    """
    rows = independent_rows(table, study.design)
    test: type[ShareTest] | None = Sequential
    if study.has_fixed_runs:
        test = FixedSample if len(table) >= runs * len(study.laws) else None
    return [
        verdict(name, demand, law_rows(place.table, law), test, law, place.point)
        for name, demand in study.require.items()
        for place in grid_points(rows, grid)
        for law in laws_in(place.table)
    ]


def verdict(
    name: str,
    demand: Requirement,
    rows: DataFrame,
    kind: type[ShareTest] | None = Sequential,
    law: str = "",
    point: str = "",
) -> Verdict:
    """Return the verdict on one requirement for one law.

    Args:
        name: of the requirement.
        demand: the requirement.
        rows: of the law, one per run.
        kind: of test; None: a fixed sample that is not complete, so undecided.
        law: for the verdict.
        point: for the verdict.
    """
    sign, column = demand.sign, f"require.{name}"
    badness, complete = penalised(rows, column, sign), is_complete(rows)
    is_unmeasured = complete & np.isinf(badness)
    runs, not_measured = len(badness), int(np.sum(is_unmeasured))
    failures = int(np.sum(~(badness < sign * demand.bound) & ~is_unmeasured))
    word: Word = "not measured" if not_measured else "undecided"
    limits, bound, needed, projected = Interval(0.0, 1.0), None, None, None
    test = kind(demand.share, demand.confidence) if kind else None
    if test and runs:
        if test.is_met(failures + not_measured, runs):
            word = "met"
        elif test.is_missed(failures, runs):
            word = "not met"
        low, high = (test.limits(f, runs) for f in (failures + not_measured, failures))
        limits = Interval(low.low, high.high)
        rank = test.bound_rank(runs)
        bound = None if rank is None else sign * float(np.sort(badness)[rank - 1])
    if isinstance(test, Sequential):
        total = test.runs_needed(failures + not_measured)
        needed = None if total is None else max(0, total - runs)
        if runs and word == "undecided":
            projected = projected_decision(test, failures, runs)
    return Verdict(
        name,
        law,
        point,
        word,
        runs,
        failures,
        int(np.sum(~complete)),
        int(rows["outcome"].isin(EXTERNAL).sum()),
        not_measured,
        limits,
        bound,
        needed,
        projected,
    )


def family_error(study: Study, verdicts: list[Verdict]) -> float:
    """Return an upper bound of the probability that any verdict is false (Bonferroni)."""
    return min(1.0, sum(1.0 - study.require[v.requirement].confidence for v in verdicts))


class ProjectedDecision(NamedTuple):
    """Expected decision on a requirement, and the number of runs it needs."""

    runs: int
    """Total number of runs."""
    met: bool


def projected_decision(test: Sequential, failures: int, runs: int) -> ProjectedDecision | None:
    """Return the first decision expected at the present rate of failures.

    It assumes ``failures / runs * n`` failures after n runs, rounded to an integer against the
    decision. This number rises in steps, and a requirement decided just before a step may be
    undecided after it, so the first decision is searched step by step.

    Args:
        test: of the requirement.
        failures: so far.
        runs: so far, at least one.

    Returns:
        None if failures are exactly as frequent as allowed, or if more than `MOST_RUNS` are needed.
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
        """Return True if it is decided without rounding; with rounding it is not earlier."""
        events, share = (rate * n, allowed) if met else ((1.0 - rate) * n, test.share)
        return bool(log_evidence(events, n, share) >= level - 1e-6)

    start = first(may_be_decided, runs, MOST_RUNS + 1)
    step, count = max(failures, failures * start // runs), 32
    while step * runs // failures <= MOST_RUNS:
        steps = np.arange(step, step + count)
        # failures are constant between steps: the last run before a step is best for "met", the
        # first run after a step is best for "not met"
        ends = steps * runs // failures if met else -(-steps * runs // failures)
        decided = test.is_met(steps, ends) if met else test.is_missed(steps, ends)
        decided &= ends >= runs
        if decided.any():
            index = int(np.argmax(decided))
            end = int(ends[index])
            if met:  # fewer runs with the same failures may suffice
                end = max(runs, test.runs_needed(int(steps[index])) or end)
            return ProjectedDecision(end, met) if end <= MOST_RUNS else None
        step, count = step + count, 2 * count
    return None
