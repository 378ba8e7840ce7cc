"""Ranking of the laws of a campaign by significant differences."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .paired import PairedComparison, compare_all
from .quantiles import Estimate, quantile
from .values import laws_of, measured, of_law

if TYPE_CHECKING:
    from pandas import DataFrame

TAIL = 0.99
"""The quantile shown beside the median."""


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
    """Rank the laws by a metric (smaller is better).

    Args:
        table: rows of a campaign, at one point of its grid.
        column: such as ``metric.attitude.rms``.
        confidence: of intervals, and of all findings of this league together.
    """
    comparisons = compare_all(table, column, confidence)
    standings = []
    for law in laws_of(table):
        values = measured(of_law(table, law), column)
        beaten_by = sum(
            c.finding == ("worse" if c.law == law else "better")
            for c in comparisons
            if law in (c.law, c.other)
        )
        standings.append(
            Ranking(
                law,
                1 + beaten_by,
                len(values),
                int(np.sum(np.isinf(values))),
                quantile(values, 0.5, confidence),
                quantile(values, TAIL, confidence),
            )
        )
    standings.sort(key=lambda s: (s.rank, s.median.value, s.tail.value))
    return League(column.removeprefix("metric."), standings, comparisons)
