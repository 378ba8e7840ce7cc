"""Quantiles and their confidence intervals, for any distribution, by order statistics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

Array = NDArray[np.float64]


class Estimate(NamedTuple):
    """A number and the two-sided confidence interval around it."""

    value: float
    low: float
    high: float


def quantile(values: Array, share: float, confidence: float = 0.95) -> Estimate:
    """Estimate the value that the share of the cases does not exceed.

    All three numbers are values that were seen, so that infinite ones (flights that failed) need no
    arithmetic. With too few values the interval is open: minus or plus infinite.

    Args:
        values: (N,) of independent runs, at least one, without NaN.
        share: within 0 to 1; 0.5 asks for the median.
        confidence: of the interval, within 0 to 1.
    """
    ordered, n = np.sort(values), len(values)
    tail = 0.5 * (1.0 - confidence)
    # Binomial(n, share) of n values lie below the quantile: fewer than `low`, or `high` and more,
    # with a probability of at most `tail` each
    low = int(binom.ppf(tail, n, share))
    high = int(binom.ppf(1.0 - tail, n, share)) + 1
    return Estimate(
        float(ordered[max(1, int(np.ceil(share * n - 1e-9))) - 1]),
        float(ordered[low - 1]) if low > 0 else -np.inf,
        float(ordered[high - 1]) if high <= n else np.inf,
    )
