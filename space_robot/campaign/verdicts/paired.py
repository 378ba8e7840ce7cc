"""Laws compared over the same draws, run by run.

A failed flight ranks below any number, and two failed flights are equal. The exact sign test
decides which law is better in most cases; the median of the runs' ratios, with an interval by order
statistics, says by how much. Neither assumes a distribution. (Wilcoxon's test assumes that
differences are symmetric about their median, which errors over decades are not.)
The same test decides whether one law fails more often, over the runs in which just one of the two
failed (McNemar's, exact). The p values of all pairs and of both tests are corrected together after
Holm (1979).
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
    """A law beside another, by a metric of which less is better."""

    law: str
    other: str
    runs: int
    """That both flew."""
    better: int
    """Runs in which the law is better."""
    worse: int
    better_share: Interval
    """Confidence interval of the share of cases in which it is better."""
    ratio: Estimate
    """Median of the law's number over the other's; NaN if there are no runs."""
    failed: int
    """Runs in which the law alone failed."""
    other_failed: int
    p_better: float
    """Of the sign test, two-sided, corrected."""
    p_failed: float
    """Of the test of failures, two-sided, corrected."""
    level: float
    """The confidence that was asked for."""

    @property
    def finding(self) -> Finding:
        """Say what is shown of the law beside the other.

        ``better`` and ``worse``: the sign test says so and the interval of the ratio excludes 1, or
        it fails less or more often; ``contradictory``: better in most cases, but fails more often,
        or the other way round; ``alike``: nothing is shown.
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
    """Compare every law with every one after it, over the runs that both flew.

    Args:
        table: rows of a campaign, at one point of its grid.
        column: of which less is better.
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
    """Compare two laws' numbers of the same runs, without correction for other comparisons.

    Args:
        a: (N,) of which less is better; infinite where the flight failed.
        b: (N,) of the same runs, of the other law.
        confidence: of the intervals.
        law: the first one's name.
        other: the second one's name.
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
    """Correct p values for their number, so that one false finding in all keeps its probability."""
    order = np.argsort(p_values, kind="stable")
    adjusted, largest = [1.0] * len(p_values), 0.0
    for place, index in enumerate(order.tolist()):
        largest = max(largest, min(1.0, (len(p_values) - place) * p_values[index]))
        adjusted[index] = largest
    return adjusted
