"""Tests of the share of cases that meet a requirement, and confidence limits of that share.

`FixedSample` is evaluated once, after a number of runs fixed in advance. `Sequential` may be
evaluated after every run, so runs can be added until there is a verdict.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, betaln, xlog1py, xlogy
from scipy.stats import beta, binom, binomtest

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
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
