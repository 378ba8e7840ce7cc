"""Influence of the variables on a metric: by ranks, and as Sobol indices of a Saltelli design.

Ranks are independent of scale and distribution; failed flights share the highest rank. The
first-order Sobol index of a variable is the share of the metric's variance by its own effect, the
total index includes its interactions with others (Saltelli et al. 2010; Jansen 1999 for the
totals).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import kruskal, norm, rankdata

from space_robot_model.elementary.matrices import Array

from .laws import Estimate, holm
from .rows import law_rows, penalised, variables

if TYPE_CHECKING:
    from pandas import DataFrame, Series

GROUPS = 8
"""Number of groups of equal size into which a variable's values are divided."""
FEWEST = 5
"""Minimum runs per group; at least two such groups are needed."""
RESAMPLED = 400
"""Number of bootstrap samples of an interval of a Sobol index."""


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

    Epsilon squared of Kruskal and Wallis over `GROUPS` groups: also detects non-monotone
    influences, such as a minimum at medium values, which a correlation does not.
    """
    p: float
    """p value of no influence (Kruskal and Wallis), corrected for the number of variables."""

    @property
    def best_correlation(self) -> Estimate | None:
        """The partial correlation if there is one, else the plain one."""
        return self.partial or self.correlation

    @property
    def strength(self) -> float:
        """Share of the variance by the larger of both measures."""
        best = self.best_correlation
        return max(self.spread, best.value**2 if best else 0.0)


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
    table: DataFrame, law: str, column: str, confidence: float = 0.95, sign: float = 1.0
) -> Sensitivity | None:
    """Compute the influence of each variable on a metric; None: no variables, or too few runs.

    The table is at one point of a grid, a column is such as ``metric.attitude.rms``, and sign is 1
    if a larger metric is worse, -1 if a smaller one is.
    """
    rows = law_rows(table, law)
    ranks = _ranks(penalised(rows, column, sign))
    varied = {name: rows[f"vary.{name}"] for name in variables(rows)}
    varied = {name: s for name, s in varied.items() if s.nunique(dropna=False) > 1}
    if len(rows) < 2 * FEWEST or not varied or not np.ptp(ranks):
        return None
    numbers = {n: s.to_numpy(np.float64) for n, s in varied.items() if s.dtype.kind in "fiu"}
    plain, partial, explained = rank_correlations(list(numbers.values()), ranks, confidence)
    correlations = dict(zip(numbers, zip(plain, partial, strict=True), strict=True))
    tested = {name: _compare_groups(series, ranks) for name, series in varied.items()}
    corrected = holm([p for _, p in tested.values()])
    influences = []
    for (name, (spread, _)), p in zip(tested.items(), corrected, strict=True):
        correlation, held = correlations.get(name, (None, None))
        influences.append(Influence(name, correlation, held, spread, p))
    influences.sort(key=lambda influence: influence.strength, reverse=True)
    return Sensitivity(law, column.partition(".")[2], len(rows), influences, explained)


def rank_correlations(
    variables: list[Array], ranks: Array, confidence: float = 0.95
) -> tuple[list[Estimate], list[Estimate | None], float | None]:
    """Compute Spearman's and partial correlations of variables (N,) with a metric's ranks (N,).

    Also returns the share explained by all (adjusted R squared). Intervals are Fisher's, with the
    variance of Bonett and Wright (2000) for ranks.
    """
    if not variables:
        return [], [], None
    count, runs = len(variables), len(ranks)
    matrix = np.corrcoef([*(_ranks(v) for v in variables), ranks])
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
    r = min(1.0, max(-1.0, r))
    if free < 1 or abs(r) == 1.0:
        return Estimate(r, -1.0 if free < 1 else r, 1.0 if free < 1 else r)
    half = float(norm.ppf(0.5 + 0.5 * confidence)) * np.sqrt((1.0 + 0.5 * r * r) / free)
    middle = np.arctanh(r)
    return Estimate(r, float(np.tanh(middle - half)), float(np.tanh(middle + half)))


def _compare_groups(series: Series, ranks: Array) -> tuple[float, float]:
    runs = len(ranks)
    if series.dtype.kind in "fiu" and series.nunique() > GROUPS:
        count = max(2, min(GROUPS, runs // FEWEST))
        places = np.minimum((_ranks(series) - 0.5) * count // runs, count - 1)
    else:
        places = series.astype("category").cat.codes.to_numpy()
    groups = [ranks[places == place] for place in np.unique(places)]
    if len(groups) < 2 or runs <= len(groups):
        return 0.0, 1.0
    test = kruskal(*groups)
    spread = (float(test.statistic) - len(groups) + 1) / (runs - len(groups))
    return max(0.0, spread), float(test.pvalue)


@dataclass(frozen=True)
class SobolIndex:
    """First-order and total index of a variable, with bootstrap intervals."""

    variable: str
    first: Estimate
    total: Estimate


@dataclass(frozen=True)
class SobolIndices:
    """The indices of all variables for a metric under a law."""

    law: str
    metric: str
    rows: int
    """Number of complete rows of the design, with a value of every flight."""
    left_out: int
    indices: list[SobolIndex]
    """Sorted by total index, largest first."""


def sobol_indices(
    values: Array, variables: list[str], law: str = "", metric: str = "", confidence: float = 0.95
) -> SobolIndices | None:
    """Compute first-order and total indices of d variables; the bootstrap has a fixed seed.

    Args:
        values: (rows, d + 2): the metric of each row of the design at A, at A with variable i from
            B for each of the d variables, and at B; rows with missing values are ignored.
        variables: their names.
        law: for the result, as ``metric``.
        metric: for the result.
        confidence: of the intervals.

    Returns:
        None if fewer than four rows are complete, or the metric does not vary.
    """
    whole = np.isfinite(values).all(axis=1)
    used = values[whole]
    if len(used) < 4 or not np.ptp(used):
        return None
    rng = np.random.default_rng(0)
    drawn = [indices(used[rng.integers(0, len(used), len(used))]) for _ in range(RESAMPLED)]
    shares = (0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence)
    with np.errstate(invalid="ignore"):
        low, high = np.nanquantile(np.array(drawn), shares, axis=0)
    each = np.stack([indices(used), low, high], axis=-1).tolist()  # first, total; variable; ends
    estimates = [
        SobolIndex(name, Estimate(*first), Estimate(*total))
        for name, first, total in zip(variables, *each, strict=True)
    ]
    estimates.sort(key=lambda index: index.total.value, reverse=True)
    return SobolIndices(law, metric, len(used), int(np.sum(~whole)), estimates)


def indices(values: Array) -> tuple[Array, Array]:
    """Compute first-order and total indices, (d,) each, of values as in `sobol_indices`."""
    a, mixed, b = values[:, 0], values[:, 1:-1].T, values[:, -1]
    both = np.concatenate([a, b])
    variance, middle = np.var(both), np.mean(both)
    with np.errstate(divide="ignore", invalid="ignore"):
        first = np.mean((b - middle) * (mixed - a), axis=1) / variance
        total = 0.5 * np.mean((a - mixed) ** 2, axis=1) / variance
    return first, total
