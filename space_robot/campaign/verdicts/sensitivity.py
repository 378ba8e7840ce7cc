"""Sensitivity of a metric to the variables, by ranks: independent of scale and distribution.

Failed flights share the highest rank.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm, rankdata

from .paired import holm
from .quantiles import Estimate
from .values import measured, of_law, variables_of

if TYPE_CHECKING:
    from pandas import DataFrame, Series

Array = NDArray[np.float64]

BINS = 8
"""Number of groups of equal size into which a variable's values are divided."""
FEWEST = 5
"""Minimum runs per group; at least two such groups are needed."""


@dataclass(frozen=True)
class Influence:
    """Influence of a variable on a metric."""

    variable: str
    correlation: Estimate | None
    """Spearman's rank correlation; None if the variable's values are texts."""
    partial: Estimate | None
    """Partial rank correlation, other numbers held fixed; None also if they determine this one."""
    spread: float
    """Share of the variance of the metric's ranks that this variable explains by itself.

    Epsilon squared of Kruskal and Wallis over `BINS` groups: also detects non-monotone influences,
    such as a minimum at medium values, which a correlation does not.
    """
    p: float
    """p value of no influence (Kruskal and Wallis), corrected for the number of variables."""


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivity of a metric under a law to all variables."""

    law: str
    metric: str
    runs: int
    influences: list[Influence]
    """The strongest first."""
    explained: float | None
    """Share of the variance of the ranks explained by a linear model of all numbers' ranks.

    The rest is noise, non-monotone influence and interaction. None: too few runs.
    """


def sensitivity(
    table: DataFrame, law: str, column: str, confidence: float = 0.95
) -> Sensitivity | None:
    """Compute the influence of each variable on a metric under a law.

    Args:
        table: rows of a campaign, at one point of its grid.
        law: as in the table.
        column: such as ``metric.attitude.rms``.
        confidence: of the intervals.

    Returns:
        None if there are no variables, or too few completed runs.
    """
    rows = of_law(table, law)
    values = measured(rows, column)
    variables = dict(variables_of(rows))
    if len(rows) < 2 * FEWEST or not variables or not np.ptp(ranked := _ranks(values)):
        return None
    numbers = {n: v.to_numpy(np.float64) for n, v in variables.items() if v.dtype.kind in "fiu"}
    correlations = rank_correlations(list(numbers.values()), ranked, confidence)
    by_name = dict(zip(numbers, zip(*correlations[:2], strict=True), strict=True))
    tested = {name: _by_groups(series, ranked) for name, series in variables.items()}
    influences = []
    for (name, (spread, _)), p in zip(
        tested.items(), holm([p for _, p in tested.values()]), strict=True
    ):
        plain, partial = by_name.get(name, (None, None))
        influences.append(Influence(name, plain, partial, spread, p))
    influences.sort(key=_strength, reverse=True)
    return Sensitivity(law, column.partition(".")[2], len(rows), influences, correlations[2])


def _strength(influence: Influence) -> float:
    best = influence.partial or influence.correlation
    return max(influence.spread, best.value**2 if best else 0.0)


def rank_correlations(
    variables: list[Array], ranked: Array, confidence: float = 0.95
) -> tuple[list[Estimate], list[Estimate | None], float | None]:
    """Compute plain and partial rank correlations of each variable with a metric.

    Intervals are Fisher's, with the variance of Bonett and Wright (2000) for ranks.

    Args:
        variables: (N,) values of each.
        ranked: (N,) ranks of the metric.
        confidence: of the intervals.

    Returns:
        Spearman's correlations; partial ones; the share explained by all (adjusted R squared).
    """
    if not variables:
        return [], [], None
    count, runs = len(variables), len(ranked)
    matrix = np.corrcoef([*(_ranks(v) for v in variables), ranked])
    plain = [_interval(float(r), runs - 3, confidence) for r in matrix[-1, :-1]]
    free = runs - count - 1
    if free < 3:
        return plain, [None] * count, None
    partial: list[Estimate | None] = [None] * count
    if np.linalg.matrix_rank(matrix[:-1, :-1], tol=1e-8) == count:
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = np.linalg.pinv(matrix)
            scale = np.sqrt(np.diag(inverse))
            held = -inverse[:-1, -1] / (scale[:-1] * scale[-1])
        partial = [_interval(float(r), free - 1, confidence) for r in held]
    explained = float(matrix[-1, :-1] @ np.linalg.pinv(matrix[:-1, :-1]) @ matrix[-1, :-1])
    return plain, partial, max(0.0, 1.0 - (1.0 - explained) * (runs - 1) / free)


def _ranks(values: Array | Series) -> Array:
    return np.asarray(rankdata(values), dtype=np.float64)


def _interval(r: float, free: int, confidence: float) -> Estimate:
    """Return a rank correlation with Fisher's interval; ``free``: N - 3 - fixed variables."""
    r = min(1.0, max(-1.0, r))
    if free < 1 or abs(r) == 1.0:
        return Estimate(r, -1.0 if free < 1 else r, 1.0 if free < 1 else r)
    half = float(norm.ppf(0.5 + 0.5 * confidence)) * np.sqrt((1.0 + 0.5 * r * r) / free)
    middle = np.arctanh(r)
    return Estimate(r, float(np.tanh(middle - half)), float(np.tanh(middle + half)))


def _by_groups(series: Series, ranked: Array) -> tuple[float, float]:
    """Return epsilon squared and the p value of Kruskal and Wallis for a variable's groups."""
    if series.dtype.kind in "fiu" and series.nunique() > BINS:
        groups = max(2, min(BINS, len(ranked) // FEWEST))
        places = np.minimum((_ranks(series) - 0.5) * groups // len(ranked), groups - 1)
    else:
        places = series.astype("category").cat.codes.to_numpy()
    _, codes = np.unique(places, return_inverse=True)
    sizes = np.bincount(codes)
    runs, groups = len(ranked), len(sizes)
    if groups < 2 or runs <= groups:
        return 0.0, 1.0
    means = np.bincount(codes, ranked) / sizes
    statistic = float(np.sum(sizes * (means - np.mean(ranked)) ** 2) / np.var(ranked, ddof=1))
    spread = max(0.0, (statistic - groups + 1) / (runs - groups))
    return spread, float(chi2.sf(statistic, groups - 1))
