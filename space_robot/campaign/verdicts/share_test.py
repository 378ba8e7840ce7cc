"""Whether runs show that a requirement is met in a share of all cases: two ways to judge.

`FixedSample` judges once, after a number of runs that was chosen before the first was flown.
`Sequential` may judge after every run, so runs may be added until a verdict is reached.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, betaln, xlog1py, xlogy
from scipy.stats import binom

from .shares import Interval, share_limits

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Numbers = float | NDArray[Any]
"""Counts, one or an array of them."""

MOST_RUNS = 10**9
"""Larger numbers of runs are not considered."""
_HALVINGS = 60


@dataclass(frozen=True)
class ShareTest(ABC):
    """A one-sided test each of "met in the share" and of "not met in the share".

    A verdict that is false comes with a probability of at most ``1 - confidence``.
    """

    share: float
    """Of the cases in which the requirement is to be met, within 0 to 1."""
    confidence: float
    """Within 0 to 1."""

    @abstractmethod
    def is_met(self, failures: Numbers, runs: Numbers) -> Bools:
        """Return True where so few failures among so many runs show that the share is met."""

    @abstractmethod
    def is_missed(self, failures: Numbers, runs: Numbers) -> Bools:
        """Return True where so many failures among so many runs show that it is not met."""

    @abstractmethod
    def limits(self, failures: int, runs: int) -> Interval:
        """Return the limits of the share of cases that meet the requirement.

        Each holds with `confidence` by itself. The low one is no less than `share` exactly if the
        requirement `is_met`, the high one no greater exactly if it `is_missed`.
        """

    def allowed_failures(self, runs: int) -> int:
        """Return the most failures with which the share is met; -1 if not even without any."""
        return first(lambda failures: not self.is_met(failures, runs), 0, runs) - 1

    def runs_needed(self, failures: int) -> int | None:
        """Return the fewest runs that meet the share with so many failures.

        None: more than `MOST_RUNS`.
        """
        runs = first(lambda n: bool(self.is_met(failures, n)), failures + 1, MOST_RUNS + 1)
        return runs if runs <= MOST_RUNS else None

    def bound_rank(self, runs: int) -> int | None:
        """Return the rank, from 1, of the ordered values that bounds their quantile `share`.

        The value of that rank is no less than the quantile, with `confidence` and for any
        distribution: it is below a limit exactly if the requirement with that limit `is_met`.
        None: there are too few runs.
        """
        allowed = self.allowed_failures(runs)
        return runs - allowed if allowed >= 0 else None


class FixedSample(ShareTest):
    """Order statistics: one look at a number of runs that was fixed before.

    As in Hanson and Beard, Applying Monte Carlo Simulation to Launch Vehicle Design and
    Requirements Analysis, NASA/TP-2010-216447: the share is met if so few failures would be seen
    with a probability (the consumer's risk) of at most ``1 - confidence`` were it just missed.
    """

    def is_met(self, failures: Numbers, runs: Numbers) -> Bools:
        """Return whether the requirement is met."""
        return np.asarray(binom.cdf(failures, runs, 1.0 - self.share) <= 1.0 - self.confidence)

    def is_missed(self, failures: Numbers, runs: Numbers) -> Bools:
        """Return whether the requirement is missed."""
        tail = binom.sf(failures - 1, runs, 1.0 - self.share)
        return np.asarray(tail <= 1.0 - self.confidence)

    def limits(self, failures: int, runs: int) -> Interval:
        """See `ShareTest`: those of Clopper and Pearson (1934)."""
        return share_limits(runs - failures, runs, self.confidence)


class Sequential(ShareTest):
    """A confidence sequence: valid after every run, however it is decided when to stop.

    See `log_evidence`. By Ville's inequality the evidence against a true hypothesis ever exceeds
    ``1 / (1 - confidence)`` with a probability of at most ``1 - confidence``.
    """

    @property
    def _threshold(self) -> float:
        return -float(np.log1p(-self.confidence))

    def is_met(self, failures: Numbers, runs: Numbers) -> Bools:
        """Return whether the requirement is met."""
        evidence = log_evidence(failures, runs, 1.0 - self.share)
        return np.asarray(evidence >= self._threshold)

    def is_missed(self, failures: Numbers, runs: Numbers) -> Bools:
        """Return whether the requirement is missed."""
        evidence = log_evidence(runs - failures, runs, self.share)
        return np.asarray(evidence >= self._threshold)

    def limits(self, failures: int, runs: int) -> Interval:
        """Return the limits of the share."""
        low = 1.0 - self._upper_limit(failures, runs)
        return Interval(low, self._upper_limit(runs - failures, runs))

    def interval(self, failures: int, runs: int) -> Interval:
        """Return the two-sided interval of the share of cases that meet the requirement.

        Both ends hold together with `confidence`, at every number of runs.
        """
        return Sequential(self.share, 0.5 + 0.5 * self.confidence).limits(failures, runs)

    def _upper_limit(self, events: int, runs: int) -> float:
        """Return the largest share of events for which the evidence is not above the threshold."""
        low, high = (events / runs, 1.0) if runs else (1.0, 1.0)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            if log_evidence(events, runs, middle) >= self._threshold:
                high = middle
            else:
                low = middle
        return high


def log_evidence(events: Numbers, runs: Numbers, share: float) -> Array:
    """Return the logarithm of the evidence against "the share of events is ``share`` or more".

    It is the likelihood of what was seen, averaged over the shares below ``share`` with Jeffreys'
    weights (Beta(1/2, 1/2), cut off there), over its likelihood at ``share``: a martingale at
    ``share`` and a supermartingale above (Robbins 1970; Howard, Ramdas, McAuliffe and Sekhon,
    Time-uniform, nonparametric, nonasymptotic confidence sequences, 2021).

    Args:
        events: seen; need not be whole numbers.
        runs: in which they were seen.
        share: above 0 and below 1.
    """
    k, n = np.asarray(events, np.float64), np.asarray(runs, np.float64)
    a, b = k + 0.5, n - k + 0.5
    with np.errstate(divide="ignore"):  # far more events than that: no evidence at all
        average = betaln(a, b) + np.log(betainc(a, b, share))
    weights = betaln(0.5, 0.5) + np.log(betainc(0.5, 0.5, share))
    evidence: Array = average - weights - xlogy(k, share) - xlog1py(n - k, -share)
    return evidence


def first(holds: Callable[[int], bool], low: int, high: int) -> int:
    """Return the least number from ``low`` on for which ``holds`` is true; ``high`` if for none.

    Steps are doubled, then halved: ``holds`` must be true of all numbers above one of which it is.
    """
    step, below = 1, low - 1
    while below + step < high and not holds(below + step):
        below, step = below + step, 2 * step
    above = min(below + step, high)
    while above - below > 1:
        middle = (below + above) // 2
        if holds(middle):
            above = middle
        else:
            below = middle
    return above
