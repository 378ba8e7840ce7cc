"""A share of runs, and how well so many runs know it (Clopper and Pearson 1934, exact)."""

from __future__ import annotations

from typing import Literal, NamedTuple

from scipy.stats import binomtest


class Interval(NamedTuple):
    """A confidence interval."""

    low: float
    high: float

    @property
    def half_width(self) -> float:
        """Return half the distance between its ends."""
        return 0.5 * (self.high - self.low)


def share_interval(successes: int, n: int, confidence: float) -> Interval:
    """Compute the two-sided interval of the share of which ``successes`` of ``n`` runs are seen.

    Args:
        successes: 0 to ``n``.
        n: runs; of none the share can be anything.
        confidence: of the interval, within 0 to 1.
    """
    return _interval(successes, n, confidence, "two-sided")


def share_limits(successes: int, n: int, confidence: float) -> Interval:
    """Compute the one-sided limits of a share: each of the two holds with ``confidence`` by itself.

    The low one is no less than a share exactly if order statistics call that share met.

    Args:
        successes: 0 to ``n``.
        n: runs; of none the share can be anything.
        confidence: of each limit, within 0 to 1.
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
