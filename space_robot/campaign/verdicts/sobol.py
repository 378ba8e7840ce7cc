"""Sobol indices of a campaign whose design is ``saltelli``: shares of a metric's variance.

The first index of a variable is the share that it brings by itself, the total one also counts what
it does together with others (Saltelli et al. 2010; Jansen 1999 for the totals).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .quantiles import Estimate

Array = NDArray[np.float64]

RESAMPLED = 400
"""Bootstrap samples of an interval."""


@dataclass(frozen=True)
class SobolIndex:
    """The two indices of a variable, with bootstrap intervals."""

    variable: str
    first: Estimate
    total: Estimate


@dataclass(frozen=True)
class SobolIndices:
    """The indices of all variables for a metric under a law."""

    law: str
    metric: str
    rows: int
    """Of the design that were used: those of which all flights have a number."""
    left_out: int
    indices: list[SobolIndex]
    """The largest total first."""


def sobol_indices(
    values: Array, variables: list[str], law: str = "", metric: str = "", confidence: float = 0.95
) -> SobolIndices | None:
    """Compute first and total indices.

    Args:
        values: (rows, d + 2): of each row of the design the metric at A, at A with variable i from
            B for each of the d variables, and at B; rows with a number missing are left out.
        variables: d names.
        law: for the result.
        metric: for the result.
        confidence: of the intervals; their draws have a seed of their own.

    Returns:
        None: fewer than four rows are whole, or the metric does not vary.
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
    """Compute first and total indices, (d,) each, of values as `sobol_indices` takes them."""
    a, mixed, b = values[:, 0], values[:, 1:-1].T, values[:, -1]
    both = np.concatenate([a, b])
    variance, middle = np.var(both), np.mean(both)
    with np.errstate(divide="ignore", invalid="ignore"):
        first = np.mean((b - middle) * (mixed - a), axis=1) / variance
        total = 0.5 * np.mean((a - mixed) ** 2, axis=1) / variance
    return first, total
