"""How often verdicts are false, exactly: `python docs/campaign_statistics.py`.

Writes the table of explanation/campaign_statistics.md, and keeps its numbers beside this file.

The failures are those of independent flights that fail with a probability just too large (for "not
met": just small enough), the worst case of both. A rule says after which runs one looks, and
whether one goes on. The probabilities of all numbers of failures are carried from look to look
(dynamic programming), so nothing is sampled but in the last line, which is.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, gammaln, xlog1py, xlogy

from space_robot.campaign.verdicts.requirements import (
    FixedSample,
    Sequential,
    ShareTest,
    first,
    log_evidence,
    projected_decision,
)

sys.path.append(str(Path(__file__).parent / "flown"))
from marks import markdown, put

PAGE = Path(__file__).parent / "explanation/campaign_statistics.md"
KEPT = Path(__file__).with_suffix(".json")
Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
SHARE, CONFIDENCE, HALF_WIDTH = 0.997, 0.9, 0.001
"""Of the example in docs/manual/campaigns.md."""
MOST = 20_000
"""Runs after which one gives up."""
FIRST = 100
"""Runs after which one looks first and goes on as the report says."""
AT_THEIR_RATE = "extended by *more runs*, at their rate"
NEGLIGIBLE = 1e-9
SAMPLES = 200_000


def pmf(counts: Array, runs: int, share: float) -> Array:
    """Return the binomial probabilities of some counts."""
    rest = np.maximum(runs - counts, 0)
    ways = gammaln(runs + 1) - gammaln(counts + 1) - gammaln(rest + 1)
    found: Array = np.exp(ways + xlogy(counts, share) + xlog1py(rest, -share))
    return np.where(counts <= runs, found, 0.0)


class Rule:
    """When a test decides, by the number of failures: the share is as it is told."""

    def __init__(self, test: ShareTest, failures: int = 160, most: int = MOST) -> None:
        """Find from how many runs on it is "met", and until how many "not met"."""
        self.test, self.failures, self.most = test, np.arange(failures), most
        self.met_from = np.array([test.runs_needed(count) or most + 1 for count in self.failures])
        self.missed_until = np.array(
            [first(lambda n, k=k: not test.is_missed(k, n), k, most + 1) - 1 for k in self.failures]
        )

    def decided(self, runs: int) -> tuple[Bools, Bools]:
        """Return for which numbers of failures it is "met", and "not met"."""
        return self.met_from <= runs, (self.missed_until >= runs) & (self.failures <= runs)

    def looking(
        self, every: int, may_stop: Callable[[int], Bools] | None = None, most: int = 0
    ) -> tuple[float, float]:
        """Return the probabilities of a false "met" and "not met" if one looks at equal distances.

        Args:
            every: runs from look to look.
            may_stop: of the runs: for which numbers of failures one stops with the verdict of that
                moment; None: as soon as there is one.
            most: runs at which one stops, decided or not; 0: as many as the rule has.
        """
        most = most or self.most
        steps = pmf(np.arange(every + 1), every, 1.0 - self.test.share)
        probability, false = np.eye(1, len(self.failures))[0], np.zeros(2)
        for runs in range(every, most + 1, every):
            probability = np.convolve(probability, steps)[: len(self.failures)]
            decided = self.decided(runs)
            stops = decided[0] | decided[1]
            if may_stop is not None:
                stops = may_stop(runs) if runs + every <= most else np.ones_like(stops)
            false += [probability[stops & word].sum() for word in decided]
            probability[stops] = 0.0
        return float(false[0]), float(false[1])

    def flying_on(self, next_look: Callable[[int, int], int | None]) -> tuple[float, float]:
        """Return the same if one flies as many more runs as the report says, again and again.

        Args:
            next_look: of failures and runs: the number of runs at which one looks next.
        """
        failure, false = 1.0 - self.test.share, np.zeros(2)
        looks = {FIRST: pmf(self.failures, FIRST, failure)}
        while looks:
            runs = min(looks)
            probability, decided = looks.pop(runs), self.decided(runs)
            false += [probability[word].sum() for word in decided]
            probability[decided[0] | decided[1]] = 0.0
            for failures in np.flatnonzero(probability > NEGLIGIBLE).tolist():
                then = next_look(failures, runs)
                if then is not None and then <= self.most:
                    further = pmf(self.failures, then - runs, failure)
                    at_then = looks.setdefault(then, np.zeros(len(self.failures)))
                    rest = len(self.failures) - failures
                    at_then[failures:] += probability[failures] * further[:rest]
        return float(false[0]), float(false[1])

    def sampled(self, samples: int = SAMPLES, seed: int = 1) -> float:
        """Return the share of sampled campaigns, looked at after every run, with a false "met"."""
        rng, met = np.random.default_rng(seed), 0
        for _ in range(samples // 1000):
            gaps = rng.geometric(1.0 - self.test.share, (1000, len(self.failures)))
            at = np.pad(np.cumsum(gaps, axis=1), ((0, 0), (1, 0)))  # the run of each failure
            met_at = np.maximum(self.met_from, at[:, :-1])
            met_at[met_at >= at[:, 1:]] = self.most + 1
            missed_at = np.where(at[:, :-1] <= self.missed_until, at[:, :-1], self.most + 1)[:, 1:]
            met += int(np.sum(met_at.min(axis=1) < missed_at.min(axis=1)))
        return met / samples


def is_precise(rule: Rule) -> Callable[[int], Bools]:
    """Return when `until` stops: as soon as the two-sided interval is narrow enough."""
    tail = 0.5 - 0.5 * rule.test.confidence

    def may_stop(runs: int) -> Bools:
        k = np.minimum(rule.failures, runs)
        if isinstance(rule.test, FixedSample):
            low = np.where(k > 0, betaincinv(np.maximum(k, 1), runs - k + 1, tail), 0.0)
            rest = np.maximum(runs - k, 1)
            high = np.where(k < runs, betaincinv(k + 1, rest, 1.0 - tail), 1.0)
        else:
            high = upper_limit(k, runs, tail)
            low = 1.0 - upper_limit(runs - k, runs, tail)
        narrow: Bools = 0.5 * (high - low) <= HALF_WIDTH
        return narrow

    return may_stop


def upper_limit(events: Array, runs: int, error: float) -> Array:
    """Return the upper limits of the share of events by a confidence sequence."""
    low, high = events / runs, np.ones(len(events))
    for _ in range(40):
        middle = 0.5 * (low + high)
        is_above = log_evidence(events, runs, np.clip(middle, 1e-300, 1.0 - 1e-16)) >= -np.log(
            error
        )
        low, high = np.where(is_above, low, middle), np.where(is_above, middle, high)
    return high


def rules(test: ShareTest) -> dict[str, Callable[[], tuple[float, float]]]:
    """Return what computes the probabilities of a false "met" and "not met" under each rule."""
    rule = Rule(test)
    found = {
        "one look, after 767 runs": lambda: rule.looking(767, most=767),
        "`until: {half_width: 0.001}`, a look every 50 runs": (
            lambda: rule.looking(50, is_precise(rule))
        ),
        "until decided, a look every 50 runs": lambda: rule.looking(50),
        "until decided, a look after every run": lambda: rule.looking(1),
        "extended by *more runs*, if none fails": (
            lambda: rule.flying_on(lambda failures, _: int(rule.met_from[failures]))
        ),
    }
    if isinstance(test, Sequential):

        def next_look(failures: int, runs: int) -> int | None:
            decision = projected_decision(test, failures, runs)
            return decision and decision.runs

        found[AT_THEIR_RATE] = lambda: rule.flying_on(next_look)
    return found


def renewed(page: str, kept: Mapping[str, list[float | None]]) -> str:
    """Return the page with the table of what is kept: shares by the name of the rule."""
    head = ("rule", "order statistics: met", "not met", "sequence: met", "not met")
    rows = [
        [name, *("" if e is None else f"{100.0 * e:.1f} %" for e in errors)]
        for name, errors in kept.items()
    ]
    return put(page, "rules", markdown(head, rows))


def main() -> None:
    """Run the command."""
    tests = FixedSample(SHARE, CONFIDENCE), Sequential(SHARE, CONFIDENCE)
    before, now = ({name: r() for name, r in rules(test).items()} for test in tests)
    kept = {name: [*before.get(name, (None, None)), *errors] for name, errors in now.items()}
    fixed, sequence = (Rule(test).sampled() for test in tests)
    kept[f"the same, {SAMPLES:,} campaigns sampled"] = [fixed, None, sequence, None]
    KEPT.write_text(json.dumps(kept, indent=1) + "\n", "utf-8")
    PAGE.write_text(renewed(PAGE.read_text("utf-8"), kept), "utf-8")


if __name__ == "__main__":
    main()
