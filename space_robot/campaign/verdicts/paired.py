"""Paired comparison of laws over the same draws.

A failed flight is worse than any value, and two failed flights are equal. The exact sign test
decides which law is better in most cases; the median ratio, with an interval by order statistics,
is the size of the effect. Neither assumes a distribution. (Wilcoxon's test assumes that
differences are symmetric about their median, which does not hold for errors over decades.)
The same test decides which law fails more often, over the runs in which exactly one of the two
failed (exact McNemar test). The p values of all pairs and of both tests are corrected together
by Holm's method (1979).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from .quantiles import Estimate, quantile
from .shares import Interval, share_interval
from .values import laws_of, measured

if TYPE_CHECKING:
    from pandas import DataFrame

Array = NDArray[np.float64]
Finding = Literal["better", "worse", "alike", "contradictory"]


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
        signs = {self._by_sign, self._by_failures} - {0}
        if len(signs) == 2:
            return "contradictory"
        return "better" if 1 in signs else "worse" if -1 in signs else "alike"

    @property
    def _by_sign(self) -> int:
        if self.p_better > 1.0 - self.level or self.ratio.low <= 1.0 <= self.ratio.high:
            return 0
        return 1 if self.better > self.worse else -1

    @property
    def _by_failures(self) -> int:
        if self.p_failed > 1.0 - self.level:
            return 0
        return 1 if self.failed < self.other_failed else -1


def compare_all(table: DataFrame, column: str, confidence: float = 0.95) -> list[PairedComparison]:
    """Compare every pair of laws over the runs that both flew.

    Args:
        table: rows of a campaign, at one point of its grid.
        column: name of the metric's column; smaller is better.
        confidence: of the intervals, and of all findings together.
    """
    ordered = table.assign(_value=measured(table, column))
    flown = {
        law: ordered[ordered["law"] == law].set_index("run")["_value"] for law in laws_of(table)
    }
    comparisons = []
    for law, other in itertools.combinations(flown, 2):
        both = flown[law].to_frame("a").join(flown[other].rename("b"), how="inner")
        comparisons.append(
            compare(both["a"].to_numpy(), both["b"].to_numpy(), confidence, law, other)
        )
    corrected = holm([p for c in comparisons for p in (c.p_better, c.p_failed)])
    pairs = zip(corrected[::2], corrected[1::2], strict=True)
    return [
        replace(c, p_better=p, p_failed=q) for c, (p, q) in zip(comparisons, pairs, strict=True)
    ]


def compare(
    a: Array, b: Array, confidence: float = 0.95, law: str = "A", other: str = "B"
) -> PairedComparison:
    """Compare the values of two laws in the same runs, without correction for multiple tests.

    Args:
        a: (N,) values of the law; smaller is better; infinite where the flight failed.
        b: (N,) values of the other law in the same runs.
        confidence: of the intervals.
        law: name of the law.
        other: name of the other law.
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


def holm(p_values: list[float]) -> list[float]:
    """Return p values corrected by Holm's method, which bounds the family-wise error rate."""
    order = np.argsort(p_values, kind="stable")
    adjusted, largest = [1.0] * len(p_values), 0.0
    for place, index in enumerate(order.tolist()):
        largest = max(largest, min(1.0, (len(p_values) - place) * p_values[index]))
        adjusted[index] = largest
    return adjusted
