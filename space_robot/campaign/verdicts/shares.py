"""Exact confidence intervals of a share of runs (Clopper and Pearson 1934)."""

from __future__ import annotations

from typing import Literal, NamedTuple

from scipy.stats import binomtest


class Interval(NamedTuple):
    """A confidence interval."""

    low: float
    high: float

    @property
    def half_width(self) -> float:
        """Half the width of the interval."""
        return 0.5 * (self.high - self.low)


def share_interval(successes: int, n: int, confidence: float) -> Interval:
    """Return the two-sided confidence interval of a share with ``successes`` in ``n`` runs.

    Args:
        successes: 0 to ``n``.
        n: number of runs; 0 gives the interval 0 to 1.
        confidence: of the interval, 0 to 1.
    """
    return _interval(successes, n, confidence, "two-sided")


def share_limits(successes: int, n: int, confidence: float) -> Interval:
    """Return the one-sided confidence limits of a share, each with ``confidence`` by itself.

    The lower limit is at least a share if and only if `FixedSample` calls that share met.

    Args:
        successes: 0 to ``n``.
        n: number of runs; 0 gives the limits 0 and 1.
        confidence: of each limit, 0 to 1.
    """
    low = _interval(successes, n, confidence, "greater").low
    return Interval(low, _interval(successes, n, confidence, "less").high)


def _interval(
    successes: int, n: int, confidence: float, side: Literal["two-sided", "greater", "less"]
) -> Interval:
    if n == 0:
        return Interval(0.0, 1.0)
    interval = binomtest(successes, n, alternative=side).proportion_ci(confidence, method="exact")
    return Interval(float(interval.low), float(interval.high))
