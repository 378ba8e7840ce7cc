"""The front of a law: its least error for each ripple, over all its gains.

After a first design (the start with several bandwidths and low-passes, gain sets around the best of
these and over the whole space) the search goes on in batches. Gain sets under which small motions
grow in some posture of the mission are not flown, and do not count. Each proposal has the least
error with a ripple of at most a share of the one that the user allows (`RIPPLE_SHARES`), or the
least ripple with an error, by what the `surrogate` predicts, each of its processes a random number
of standard deviations off its mean (as in Berk et al., Randomised Gaussian process upper confidence
bound for Bayesian optimisation, arXiv:2006.04296). Candidates are in a region around the best gain
set known for that ripple, which shrinks as the search goes on, and such as have some coordinates of
it and some of another gain set, since base and joints are nearly independent. Every gain set that
was tried is kept: the front is those which no other beats in both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array

from .search_space import SearchSpace
from .surrogate import Surrogates
from .trials import ALLOWED_SATURATION, Score, Trials

RIPPLE_SHARES = (1.0, 0.3, 1.0, 0.1, 1.0, 3.0, 1.0, 1.0)
"""Ripples of a batch's gain sets, as shares of the one allowed."""
BATCH = 8
"""Gain sets of a batch: two batches of lanes, with two trials each."""
FIRST_DESIGN = 0.2
"""Share of the gain sets, two batches or more, that the surrogates do not propose."""
FIRST_SPREAD = 0.2
"""Standard deviation of the first design around the best of the start; a third is over all."""
LONGEST, SHORTEST = 0.4, 0.05
"""Half the side of the first and of the last region; 1: the whole range of a coordinate."""
LAST_PART = 0.6
"""Share of the batches after which only the ripple allowed counts."""
MOST_UNSTABLE = 3
"""Most gain sets tried, with those that are not flown, relative to the number to fly."""
CANDIDATES, ROUNDS = 400, 4
"""Points from which a proposal is chosen, and rounds, each in half the region of the last."""
OUTSIDE, WEIGHT = 1e3, 3.0
"""What is added to the logarithm of an error if the ripple is beyond its bound, and how much the
ripple's counts there: by ripple alone the search would end at gains that hardly control."""


class Goal(NamedTuple):
    """The place on a front that a search is for."""

    ripple: float
    """Least error with at most this ripple, a share of the largest torque."""
    error: float | None = None
    """If set: least ripple with at most this error."""

    def cost(self, error: Any, ripple: Any) -> Any:
        """Return what is least at the place, of logarithms."""
        value, excess = error, ripple - math.log(self.ripple)
        if self.error is not None:
            value, excess = ripple, error - math.log(self.error)
        return value + np.where(excess > 0.0, OUTSIDE + WEIGHT * excess, 0.0)


class Tried(NamedTuple):
    """A gain set that was tried."""

    point: Array
    """(d,) in the search space."""
    score: Score


@dataclass(frozen=True)
class Front:
    """What the search has found for one law."""

    law: str
    tried: list[Tried]
    """All gain sets, in the order in which they were tried; the first one is the start."""

    @property
    def best(self) -> list[Tried]:
        """The gain sets that no other beats in both, by growing ripple."""
        flyable = sorted(
            (t for t in self.tried if t.score.is_flyable),
            key=lambda tried: (tried.score.ripple, tried.score.error),
        )
        front: list[Tried] = []
        for tried in flyable:
            if not front or tried.score.error < front[-1].score.error:
                front.append(tried)
        return front

    def within(self, ripple: float) -> Tried | None:
        """Return the gain set of least error with at most a ripple, as a share; None: none has."""
        allowed = [tried for tried in self.best if tried.score.ripple <= ripple]
        return allowed[-1] if allowed else None

    def nearest(self, goal: Goal) -> Tried:
        """Return the gain set of a goal, else the one that lacks least for it."""

        def cost(tried: Tried) -> tuple[float, ...]:
            score = tried.score
            return max(0.0, score.growth), -score.flown, goal.cost(*np.log(score[:2]))

        return min(self.best or self.tried, key=cost)

    @property
    def flown(self) -> int:
        """Number of gain sets that were flown: all but those under which small motions grow."""
        return sum(tried.score.growth <= 0.0 for tried in self.tried)

    def chosen(self, goal: Goal) -> Tried | None:
        """Return the gain set of a goal; None: none has so little ripple, or error."""
        if goal.error is None:
            return self.within(goal.ripple)
        return next((tried for tried in self.best if tried.score.error <= goal.error), None)

    def why_none(self, goal: Goal) -> str:
        """Say why there is no gain set of a goal."""
        count, scores = len(self.tried), [tried.score for tried in self.tried]
        grows = sum(score.growth > 0.0 for score in scores)
        ended = sum(score.flown < 1.0 for score in scores) - grows
        beyond = sum(score.beyond for score in scores)
        held = sum(score.held for score in scores)
        full = sum(score.saturation > ALLOWED_SATURATION for score in scores)
        if self.best and goal.error is not None:
            return f"error of at least {self.best[-1].score.error:.3g}"
        if self.best:
            return f"ripple of at least {self.best[0].score.ripple:.1%} of the largest torque"
        return (
            f"none of {count} gain sets: {grows} unstable in some posture, {ended} diverged, "
            f"{beyond} beyond limits of effort, {held} held by friction, "
            f"{full} with wheels at their limit"
        )


def search_front(
    trials: Trials,
    space: SearchSpace,
    goal: Goal,
    evaluations: int,
    seed: int,
    shares: Sequence[float] = RIPPLE_SHARES,
    progress: Callable[[int], object] = lambda count: None,
) -> Front:
    """Search the front of a law.

    Args:
        trials: that are flown with each gain set.
        space: of the gains.
        goal: for which more gain sets are tried than for the rest of the front.
        evaluations: gain sets to try, in all.
        seed: of the search.
        shares: of its ripple, or error, with which is searched in turn.
        progress: called with the number of gain sets after each batch.
    """
    front, random = Front(trials.law.name, []), np.random.default_rng(seed)

    def fly(points: Sequence[Array]) -> None:
        scores = trials.fly([space.at(point) for point in points])
        front.tried.extend(map(Tried, points, scores))
        progress(sum(score.growth <= 0.0 for score in scores))

    fly([space.origin, *space.ladder][:evaluations])
    first = min(evaluations, max(2 * BATCH, round(FIRST_DESIGN * evaluations / BATCH) * BATCH))
    fly(_around(front.nearest(goal).point, first - len(front.tried), random))
    surrogates = Surrogates(space, goal.ripple)
    most = MOST_UNSTABLE * evaluations
    while (left := evaluations - front.flown) > 0 and len(front.tried) < most:
        part = min(1.0, max(0.0, (front.flown - first) / max(1, evaluations - first)))
        length = LONGEST * (SHORTEST / LONGEST) ** part
        points = np.array([tried.point for tried in front.tried])
        scores = [tried.score for tried in front.tried]
        if front.flown and all(score.flown < 1.0 for score in scores):
            fly(list(random.random((min(left, BATCH), space.dimension))))
            continue
        surrogates.fit(points, scores)
        proposed = []
        for number in range(min(left, BATCH)):
            share = 1.0 if part > LAST_PART else shares[number % len(shares)]
            own = goal._replace(ripple=share * goal.ripple)
            if goal.error is not None:
                own = goal._replace(error=goal.error / share)
            known = np.vstack([front.nearest(own).point, points])
            reach = length if number or part > LAST_PART else 1.0
            proposed.append(_propose(surrogates, known, own, reach, random))
        fly(proposed)
    return front


def _around(best: Array, count: int, random: np.random.Generator) -> list[Array]:
    from scipy.stats import norm, qmc

    if count <= 0:
        return []
    power = math.ceil(math.log2(count))
    spread = qmc.Sobol(len(best), seed=random).random_base2(power)[:count]
    near = np.clip(best + FIRST_SPREAD * norm.ppf(np.clip(spread, 0.01, 0.99)), 0.0, 1.0)
    return list(np.where(np.arange(count)[:, None] % 3 < 2, near, spread))


def _propose(
    surrogates: Surrogates, known: Array, goal: Goal, length: float, random: np.random.Generator
) -> Array:
    # known (N, d): points tried, the first one is the middle of the region
    best: Array = known[0]
    deviations = surrogates.draw(random)
    shape = CANDIDATES, len(best)
    others = known[random.integers(len(known), size=CANDIDATES)]
    points = np.where(random.random(shape) < 0.5, others, best)
    for half in length * 0.5 ** np.arange(ROUNDS):
        near = best + half * random.uniform(-1.0, 1.0, shape)
        points = np.clip(np.vstack([best, near, points]), 0.0, 1.0)
        best = points[np.argmin(goal.cost(*surrogates.predict(points, deviations)))]
        points = points[:0]
    return best
