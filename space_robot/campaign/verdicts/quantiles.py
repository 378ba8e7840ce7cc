"""Distribution-free quantiles and confidence intervals by order statistics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

Array = NDArray[np.float64]


class Estimate(NamedTuple):
    """An estimate with its two-sided confidence interval."""

    value: float
    low: float
    high: float


def quantile(values: Array, share: float, confidence: float = 0.95) -> Estimate:
    """Estimate a quantile and its confidence interval.

    All three numbers are sample values, so infinite ones (failed flights) need no arithmetic. With
    too few values an end of the interval is infinite.

    Args:
        values: (N,) of independent runs, N > 0, without NaN.
        share: probability of the quantile, 0 to 1; 0.5 for the median.
        confidence: of the interval, 0 to 1.
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
