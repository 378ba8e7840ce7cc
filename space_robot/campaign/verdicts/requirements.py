"""Verdicts on requirements, and the tests of a share of cases on which they rest.

`FixedSample` is evaluated once, after a number of runs fixed in advance. `Sequential` may be
evaluated after every run, so runs can be added until there is a verdict.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, betaln, xlog1py, xlogy
from scipy.stats import beta, binom, binomtest

from space_robot_model.elementary.matrices import Array

from .rows import EXTERNAL, grid_points, independent_rows, is_complete, law_rows, laws_in, penalised

if TYPE_CHECKING:
    from pandas import DataFrame

    from ..study import Requirement, Study

Bools = NDArray[np.bool_]
Word = Literal["met", "not met", "undecided", "not measured"]
Numbers = float | NDArray[Any]
"""A count or an array of counts."""

MOST_RUNS = 10**9
"""Largest number of runs considered."""
HALVINGS = 60


class Interval(NamedTuple):
    """A confidence interval."""

    low: float
    high: float

    @property
    def half_width(self) -> float:
        """Half the width of the interval."""
        return 0.5 * (self.high - self.low)


def share_interval(successes: int, runs: int, confidence: float) -> Interval:
    """Return the two-sided interval of a share by Clopper and Pearson (1934); 0 to 1 of no runs."""
    if runs == 0:
        return Interval(0.0, 1.0)
    interval = binomtest(successes, runs).proportion_ci(confidence, method="exact")
    return Interval(float(interval.low), float(interval.high))


@dataclass(frozen=True)
class ShareTest(ABC):
    """One-sided tests of "met in the required share" and of "not met in the required share".

    A verdict is false with a probability of at most ``1 - confidence``.
    """

    share: float
    """Required share of the cases that meet the requirement, 0 to 1."""
    confidence: float
    """Confidence of each test, 0 to 1."""

    @abstractmethod
    def is_below(self, events: Numbers, runs: Numbers, share: float) -> Bools:
        """Return True where so few ``events`` prove that their share of the cases is smaller."""

    @abstractmethod
    def upper_limit(self, events: int, runs: int) -> float:
        """Return the one-sided confidence limit of the share of events."""

    def is_met(self, failures: Numbers, runs: Numbers) -> Bools:
        """Return True where the number of failures proves the requirement met."""
        return self.is_below(failures, runs, 1.0 - self.share)

    def is_missed(self, failures: Numbers, runs: Numbers) -> Bools:
        """Return True where the number of failures proves the requirement not met."""
        return self.is_below(runs - failures, runs, self.share)

    def limits(self, failures: int, runs: int) -> Interval:
        """Return one-sided confidence limits of the share of cases that meet the requirement.

        The lower limit is at least `share` if and only if `is_met`, the upper one at most `share`
        if and only if `is_missed`.
        """
        low = 1.0 - self.upper_limit(failures, runs)
        return Interval(low, self.upper_limit(runs - failures, runs))

    def allowed_failures(self, runs: int) -> int:
        """Return the largest number of failures that is still "met"; -1 if there is none."""
        return first(lambda failures: not self.is_met(failures, runs), 0, runs) - 1

    def runs_needed(self, failures: int) -> int | None:
        """Return the smallest number of runs for "met" with a number of failures.

        None: more than `MOST_RUNS`.
        """
        runs = first(lambda n: bool(self.is_met(failures, n)), failures + 1, MOST_RUNS + 1)
        return runs if runs <= MOST_RUNS else None

    def bound_rank(self, runs: int) -> int | None:
        """Return the rank, from 1, of the order statistic that bounds the quantile `share`.

        It is an upper bound of the quantile with `confidence` for any distribution, and below a
        limit if and only if the requirement with that limit `is_met`. None: too few runs.
        """
        allowed = self.allowed_failures(runs)
        return runs - allowed if allowed >= 0 else None


class FixedSample(ShareTest):
    """Order statistics: one evaluation after a number of runs fixed in advance.

    As in Hanson and Beard, Applying Monte Carlo Simulation to Launch Vehicle Design and
    Requirements Analysis, NASA/TP-2010-216447: the requirement is met if, for a true share equal to
    the required one, so few failures have a probability (consumer's risk) of at most
    ``1 - confidence``. Limits are those of Clopper and Pearson (1934).
    """

    def is_below(self, events: Numbers, runs: Numbers, share: float) -> Bools:  # noqa: D102
        return np.asarray(binom.cdf(events, runs, share) <= 1.0 - self.confidence)

    def upper_limit(self, events: int, runs: int) -> float:  # noqa: D102
        return float(beta.ppf(self.confidence, events + 1, runs - events)) if events < runs else 1.0


class Sequential(ShareTest):
    """A confidence sequence: valid after every run, for any stopping rule.

    By Ville's inequality the evidence (`log_evidence`) against a true hypothesis ever exceeds
    ``1 / (1 - confidence)`` with a probability of at most ``1 - confidence``.
    """

    def is_below(self, events: Numbers, runs: Numbers, share: float) -> Bools:  # noqa: D102
        threshold = -np.log1p(-self.confidence)
        return np.asarray(log_evidence(events, runs, share) >= threshold)

    def upper_limit(self, events: int, runs: int) -> float:  # noqa: D102
        low, high = (events / runs, 1.0) if runs else (1.0, 1.0)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            if self.is_below(events, runs, middle):
                high = middle
            else:
                low = middle
        return high

    def interval(self, failures: int, runs: int) -> Interval:
        """Return the two-sided interval of the share of cases that meet the requirement.

        The interval has the confidence `confidence` for all numbers of runs jointly.
        """
        return Sequential(self.share, 0.5 + 0.5 * self.confidence).limits(failures, runs)


def log_evidence(events: Numbers, runs: Numbers, share: float) -> Array:
    """Return the logarithm of the evidence against "the share of events is ``share`` or more".

    It is the mean likelihood over shares below ``share`` with Jeffreys' prior (Beta(1/2, 1/2),
    truncated there), divided by the likelihood at ``share``: a martingale at ``share`` and a
    supermartingale above (Robbins 1970; Howard, Ramdas, McAuliffe and Sekhon, Time-uniform,
    nonparametric, nonasymptotic confidence sequences, 2021).

    Args:
        events: number of events; need not be an integer.
        runs: number of runs.
        share: above 0 and below 1.
    """
    k, n = np.asarray(events, np.float64), np.asarray(runs, np.float64)
    a, b = k + 0.5, n - k + 0.5
    with np.errstate(divide="ignore"):  # log(0) for far more events: no evidence
        average = betaln(a, b) + np.log(betainc(a, b, share))
    weights = betaln(0.5, 0.5) + np.log(betainc(0.5, 0.5, share))
    evidence: Array = average - weights - xlogy(k, share) - xlog1py(n - k, -share)
    return evidence


def first(holds: Callable[[int], bool], low: int, high: int) -> int:
    """Return the smallest integer in [low, high) for which ``holds`` is true, else ``high``.

    ``holds`` must be monotone: if it is true for a number, then also for all larger ones.
    """
    return low + bisect_left(range(low, high), True, key=lambda n: bool(holds(n)))


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
    id: str | None
    """Identifier of the requirement in a file of requirements."""

    @property
    def met(self) -> int:
        """Number of runs that met the requirement."""
        return self.runs - self.failures - self.not_measured

    @property
    def share(self) -> float:
        """Share of the runs that met the requirement; NaN without runs."""
        return self.met / self.runs if self.runs else float("nan")


def verdicts(table: DataFrame, study: Study, runs: int, grid: Sequence[str] = ()) -> list[Verdict]:
    """Return the verdict on every requirement, for every law and point of the ``grid`` variables.

    A fixed number of ``runs`` must be complete before anything is decided.
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
    """Return the verdict on one requirement for one law, of which there is a row per run.

    ``kind`` of test is None for a fixed sample that is not complete: it is undecided.
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
        demand.id,
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
