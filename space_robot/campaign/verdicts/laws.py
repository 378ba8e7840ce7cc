"""Comparison of laws over the same draws, and their ranks.

A failed flight is worse than any value, and two failed flights are equal. The exact sign test
decides which law is better in most cases; the median ratio, with an interval by order statistics,
is the size of the effect. Neither assumes a distribution. (Wilcoxon's test assumes that
differences are symmetric about their median, which does not hold for errors over decades.)
The same test decides which law fails more often, over the runs in which exactly one of the two
failed (exact McNemar test). The p values of all pairs and of both tests are corrected jointly
by Holm's method (1979).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from scipy.stats import binom, binomtest

from space_robot_model.elementary.matrices import Array

from .requirements import Interval, share_interval
from .rows import law_rows, laws_in, penalised

if TYPE_CHECKING:
    from pandas import DataFrame

Finding = Literal["better", "worse", "alike", "contradictory"]

TAIL = 0.99
"""Probability of the quantile in the tail."""


class Estimate(NamedTuple):
    """An estimate with its two-sided confidence interval."""

    value: float
    low: float
    high: float


def quantile(values: Array, share: float, confidence: float = 0.95) -> Estimate:
    """Estimate a quantile and its distribution-free confidence interval, by order statistics.

    All three numbers are of the (N,) values, N > 0 and none NaN, so infinite ones (failed flights)
    need no arithmetic. With too few values an end of the interval is infinite.
    """
    ordered, n = np.sort(values), len(values)
    tail = 0.5 * (1.0 - confidence)
    # the number of values below the quantile is Binomial(n, share): it is less than `low`, or at
    # least `high`, with a probability of at most `tail` each
    low = int(binom.ppf(tail, n, share))
    high = int(binom.ppf(1.0 - tail, n, share)) + 1
    return Estimate(
        float(ordered[max(1, int(np.ceil(share * n - 1e-9))) - 1]),
        float(ordered[low - 1]) if low > 0 else -np.inf,
        float(ordered[high - 1]) if high <= n else np.inf,
    )


@dataclass(frozen=True)
class PairedComparison:
    """Comparison of a law with another one by a metric (smaller is better)."""

    law: str
    other: str
    runs: int
    """Number of runs that both laws flew."""
    better: int
    """Number of runs in which the law is better."""
    worse: int
    better_share: Interval
    """Confidence interval of the share of cases in which the law is better."""
    ratio: Estimate
    """Median ratio of the law's value to the other's; NaN if there are no runs."""
    failed: int
    """Number of runs in which only the law failed."""
    other_failed: int
    p_better: float
    """Corrected two-sided p value of the sign test."""
    p_failed: float
    """Corrected two-sided p value of the test of failures."""
    level: float
    """Confidence of the intervals and of the finding."""

    @property
    def finding(self) -> Finding:
        """Return the significant difference of the law from the other.

        ``better`` and ``worse``: by the sign test with a ratio interval that excludes 1, or by the
        number of failures; ``contradictory``: better in most cases, but fails more often, or vice
        versa; ``alike``: no significant difference.
        """
        signs, alpha = set(), 1.0 - self.level
        if self.p_better <= alpha and not self.ratio.low <= 1.0 <= self.ratio.high:
            signs.add(1 if self.better > self.worse else -1)
        if self.p_failed <= alpha:
            signs.add(1 if self.failed < self.other_failed else -1)
        if len(signs) == 2:
            return "contradictory"
        return "better" if 1 in signs else "worse" if -1 in signs else "alike"


def compare_all(table: DataFrame, column: str, confidence: float = 0.95) -> list[PairedComparison]:
    """Compare every pair of laws at one point of a grid over the runs that both flew.

    Smaller values of the column are better; ``confidence`` is that of all findings jointly.
    """
    numbers = table[["run", "law"]].assign(value=penalised(table, column))
    by_law = numbers.pivot(index="run", columns="law", values="value")
    comparisons = []
    for law, other in itertools.combinations(laws_in(table), 2):
        a, b = by_law[[law, other]].dropna().to_numpy().T
        comparisons.append(compare(a, b, confidence, law, other))
    corrected = holm([p for c in comparisons for p in (c.p_better, c.p_failed)])
    pairs = zip(corrected[::2], corrected[1::2], strict=True)
    return [
        replace(c, p_better=p, p_failed=q) for c, (p, q) in zip(comparisons, pairs, strict=True)
    ]


def compare(
    a: Array, b: Array, confidence: float = 0.95, law: str = "A", other: str = "B"
) -> PairedComparison:
    """Compare the values (N,) of two laws in the same runs, without correction for multiple tests.

    Smaller values are better, infinite ones are of flights that failed.
    """
    runs, better, worse = len(a), int(np.sum(a < b)), int(np.sum(a > b))
    failed, other_failed = (
        int(np.sum(np.isinf(one) & np.isfinite(two))) for one, two in ((a, b), (b, a))
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.where(a == b, 1.0, a / b)
    return PairedComparison(
        law,
        other,
        runs,
        better,
        worse,
        share_interval(better, runs, confidence),
        quantile(ratios, 0.5, confidence) if runs else Estimate(np.nan, 0.0, np.inf),
        failed,
        other_failed,
        _sign_test(better, worse),
        _sign_test(failed, other_failed),
        confidence,
    )


def _sign_test(one: int, two: int) -> float:
    return float(binomtest(one, one + two).pvalue) if one + two else 1.0


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p values corrected by Holm's method, which bounds the family-wise error rate."""
    p = np.asarray(p_values, np.float64)
    order = np.argsort(p, kind="stable")
    corrected = np.empty_like(p)
    scaled = np.minimum(1.0, np.arange(len(p), 0, -1) * p[order])
    corrected[order] = np.maximum.accumulate(scaled)
    return [float(each) for each in corrected]


@dataclass(frozen=True)
class Ranking:
    """Rank of a law by a metric."""

    law: str
    rank: int
    """One more than the number of significantly better laws; several laws may share a rank."""
    runs: int
    failures: int
    """Number of flights without value; quantiles count them as infinite."""
    median: Estimate
    tail: Estimate
    """The quantile `TAIL`."""


@dataclass(frozen=True)
class League:
    """Ranking of all laws by one metric at one point of the grid."""

    metric: str
    standings: list[Ranking]
    """Ordered by rank, median and tail quantile."""
    comparisons: list[PairedComparison]
    """Comparisons of all pairs, from which the ranks follow."""


def league(table: DataFrame, column: str, confidence: float = 0.95) -> League:
    """Rank the laws at one point of a grid by a column such as ``metric.attitude.rms``."""
    comparisons = compare_all(table, column, confidence)
    losers = [c.other for c in comparisons if c.finding == "better"]
    losers += [c.law for c in comparisons if c.finding == "worse"]
    standings = []
    for law in laws_in(table):
        values = penalised(law_rows(table, law), column)
        standings.append(
            Ranking(
                law,
                1 + losers.count(law),
                len(values),
                int(np.isinf(values).sum()),
                quantile(values, 0.5, confidence),
                quantile(values, TAIL, confidence),
            )
        )
    standings.sort(key=lambda s: (s.rank, s.median.value, s.tail.value))
    return League(column.removeprefix("metric."), standings, comparisons)
