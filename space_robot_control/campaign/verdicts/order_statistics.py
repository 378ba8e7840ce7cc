"""Order statistics: how many failures among how many runs show that a share is met.

As in Hanson and Beard, Applying Monte Carlo Simulation to Launch Vehicle Design and Requirements
Analysis, NASA/TP-2010-216447: a requirement "met in the share y of cases, with confidence z" is
shown to be met by n independent runs with k failures if so few would be seen with a probability
(the consumer's risk) of at most 1 - z were the share of failures 1 - y.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from scipy.stats import binom

MOST_RUNS = 10**9
"""Of more runs nothing is said."""


def is_met(failures: int, n: int, share: float, confidence: float) -> bool:
    """Tell whether so few failures among ``n`` runs show that the share is met.

    Args:
        failures: 0 to ``n``.
        n: independent runs.
        share: y, of the cases in which a requirement is to be met, within 0 to 1.
        confidence: z, within 0 to 1.
    """
    return bool(binom.cdf(failures, n, 1.0 - share) <= 1.0 - confidence)


def is_missed(failures: int, n: int, share: float, confidence: float) -> bool:
    """Tell whether so many failures among ``n`` runs show that the share is not met.

    Arguments as of `is_met`.
    """
    return bool(binom.sf(failures - 1, n, 1.0 - share) <= 1.0 - confidence)


def allowed_failures(n: int, share: float, confidence: float) -> int:
    """Return the most failures with which ``n`` runs still meet the share; -1 if not even none."""
    return _first(lambda k: not is_met(k, n, share, confidence), 0, n) - 1


def runs_needed(failures: int, share: float, confidence: float) -> int | None:
    """Return the fewest runs that meet the share with so many failures; None: over `MOST_RUNS`."""
    found = _first(lambda n: is_met(failures, n, share, confidence), failures + 1, MOST_RUNS + 1)
    return found if found <= MOST_RUNS else None


class Outlook(NamedTuple):
    """After how many runs in all a requirement would be decided, and how."""

    runs: int
    met: bool


def outlook(failures: int, n: int, share: float, confidence: float) -> Outlook | None:
    """Foretell the decision if failures go on at the rate seen; None: over `MOST_RUNS` runs.

    Failures are rounded up to whole ones where they speak for the decision too little, so the
    number of runs is never too small.

    Args:
        failures: seen so far.
        n: runs so far, at least one.
        share: as of `is_met`.
        confidence: as of `is_met`.
    """
    rate = failures / n
    met = rate < 1.0 - share

    def decided(runs: int) -> bool:
        expected, rest = divmod(failures * runs, n)
        if met:
            return is_met(expected + (rest > 0), runs, share, confidence)
        return is_missed(expected, runs, share, confidence)

    found = _first(decided, n, MOST_RUNS + 1)
    return Outlook(found, met) if found <= MOST_RUNS else None


def bound_rank(n: int, share: float, confidence: float) -> int | None:
    """Return which of ``n`` ordered values is no less than the quantile ``share``.

    It is so with ``confidence`` whatever the distribution (a nonparametric tolerance bound):
    the value of that rank, counted from 1, is below a limit exactly if `is_met` says so. None:
    there are too few runs for any of them.
    """
    allowed = allowed_failures(n, share, confidence)
    return n - allowed if allowed >= 0 else None


def _first(holds: Callable[[int], bool], low: int, high: int) -> int:
    """Find the least number from ``low`` on that ``holds``; ``high`` if none does.

    It doubles its steps, then halves them: what holds of a number should hold of greater ones.
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
