"""Sobol indices of a campaign with the design ``saltelli``: shares of a metric's variance.

The first-order index of a variable is the share of its own effect, the total index includes its
interactions with others (Saltelli et al. 2010; Jansen 1999 for the totals).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .quantiles import Estimate

Array = NDArray[np.float64]

RESAMPLED = 400
"""Number of bootstrap samples of an interval."""


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
    """Compute first-order and total indices.

    Args:
        values: (rows, d + 2): the metric of each row of the design at A, at A with variable i from
            B for each of the d variables, and at B; rows with missing values are ignored.
        variables: d names.
        law: for the result.
        metric: for the result.
        confidence: of the intervals; the bootstrap has a fixed seed.

    Returns:
        None if fewer than four rows are complete, or the metric does not vary.
    """
    whole = np.isfinite(values).all(axis=1)
    used = values[whole]
    if len(used) < 4 or not np.ptp(used):
        return None
    first, total = indices(used)
    rng = np.random.default_rng(0)
    drawn = [indices(used[rng.integers(0, len(used), len(used))]) for _ in range(RESAMPLED)]
    shares = (0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence)
    with np.errstate(invalid="ignore"):
        bounds = np.nanquantile(
            np.array(drawn), shares, axis=0
        )  # low, high; first, total; variable
    estimates = [
        SobolIndex(
            name,
            *(
                Estimate(float(value[i]), *map(float, bounds[:, kind, i]))
                for kind, value in enumerate((first, total))
            ),
        )
        for i, name in enumerate(variables)
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
