"""After how many runs a sequential verdict would be reached if failures go on at their rate."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .share_test import MOST_RUNS, Sequential, first, log_evidence

_STEPS = 32
"""That are looked at together first; then twice as many, and so on."""


class ProjectedDecision(NamedTuple):
    """The number of runs after which a requirement would be decided, and how."""

    runs: int
    """In all."""
    met: bool


def projected_decision(test: Sequential, failures: int, runs: int) -> ProjectedDecision | None:
    """Return the first decision if failures go on at the rate seen.

    After n runs there are then ``failures / runs * n`` failures, rounded to whole ones against the
    decision. So the number of failures rises in steps, and what is decided just before a step may
    be open after it: the first decision is searched step by step.

    Args:
        test: of the requirement.
        failures: seen so far.
        runs: flown so far, at least one.

    Returns:
        None: failures are exactly as frequent as allowed, or it takes more than `MOST_RUNS` runs.
    """
    rate, allowed = failures / runs, 1.0 - test.share
    if rate == allowed:
        return None
    met = rate < allowed
    if failures == 0:
        needed = test.runs_needed(0)
        return None if needed is None else ProjectedDecision(max(runs, needed), True)
    level = -np.log1p(-test.confidence)

    def may_be_decided(n: int) -> bool:
        """Return True if it is decided without rounding; with rounding it is no sooner."""
        events, share = (rate * n, allowed) if met else ((1.0 - rate) * n, test.share)
        return bool(log_evidence(events, n, share) >= level - 1e-6)

    start = first(may_be_decided, runs, MOST_RUNS + 1)
    step, count = max(failures, failures * start // runs), _STEPS
    while step * runs // failures <= MOST_RUNS:
        steps = np.arange(step, step + count)
        # failures stay whole and alike from one end to the next: the last run before a step speaks
        # most for "met", the first run of a step most for "not met"
        ends = steps * runs // failures if met else -(-steps * runs // failures)
        decided = test.is_met(steps, ends) if met else test.is_missed(steps, ends)
        decided &= ends >= runs
        if decided.any():
            index = int(np.argmax(decided))
            end = int(ends[index])
            if met:  # with as many failures fewer runs may do
                end = max(runs, test.runs_needed(int(steps[index])) or end)
            return ProjectedDecision(end, met) if end <= MOST_RUNS else None
        step, count = step + count, 2 * count
    return None
