"""The front of a law: its least error for each ripple, over all its gains.

CMA-ES (Hansen, The CMA evolution strategy: a tutorial, arXiv:1604.00772; package `cma`) first
minimises the error with the ripple that the user allows,

    log(error) + 2 max(0, log(ripple / allowed)),

then, for the rest of the front, ``(1 - w) log(error) + w log(ripple)`` for some weights w, each
from the best point known. Every gain set that was tried is kept: the front is those which no other
beats in error and ripple both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .search_space import SearchSpace
from .trials import Score, Trials

Array = NDArray[np.float64]

RIPPLE_WEIGHTS = (0.5, 0.8)
"""Weights of the ripple, from fast laws to smooth ones."""
FIRST_PART = 0.5
"""Share of the gain sets for the least error with the ripple allowed."""
EXCESS_WEIGHT = 2.0
"""Weight of the logarithm of the ripple beyond what is allowed."""
POPULATION = 8
"""Gain sets of a generation: two batches of lanes, with two trials each."""
FIRST_DESIGN = 16
"""Gain sets spread over the whole space, and the tuned one, before the search."""
FIRST_STEP, NEXT_STEP = 0.15, 0.08
"""Standard deviation of the first generation of the first weight and of the others; 1: the whole
range of a coordinate."""
FAILED = 100.0
"""Objective of a gain set that did not fly to the end, less its share of the flight."""
SATURATION_WEIGHT = 20.0
"""Weight of the share of ticks with a wheel at its limit, beyond `ALLOWED_SATURATION`."""
ALLOWED_SATURATION = 0.01


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
    """All gain sets, in the order in which they were tried; the first one is the tuned one."""

    @property
    def best(self) -> list[Tried]:
        """The gain sets that no other beats in both, by growing ripple."""
        flyable = sorted(
            (t for t in self.tried if is_acceptable(t.score)),
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

    def why_none(self) -> str:
        """Say why no gain set has as little ripple as allowed."""
        count, scores = len(self.tried), [tried.score for tried in self.tried]
        ended = sum(score.flown < 1.0 for score in scores)
        beyond = sum(score.beyond for score in scores)
        full = sum(score.saturation > ALLOWED_SATURATION for score in scores)
        if self.best:
            return f"ripple of at least {self.best[0].score.ripple:.1%} of the largest torque"
        return (
            f"none of {count} gain sets: {ended} diverged, {beyond} beyond limits of effort, "
            f"{full} with wheels at their limit"
        )

    def error_at(self, ripple: float) -> float:
        """Return the least error with at most a ripple; infinite: no gain set has so little."""
        tried = self.within(ripple)
        return tried.score.error if tried else math.inf


def is_acceptable(score: Score) -> bool:
    """Return True if a gain set flew all trials within the limits of joints and wheels."""
    return score.is_flyable and score.saturation <= ALLOWED_SATURATION


def least_error(score: Score, allowed: float) -> float:
    """Return what is minimised for the least error with a ripple, see the module."""
    return _or_failed(
        score, lambda error, ripple: error + EXCESS_WEIGHT * max(0.0, ripple - math.log(allowed))
    )


def weighted(score: Score, weight: float) -> float:
    """Return what is minimised for a weight of the ripple, see the module."""
    return _or_failed(score, lambda error, ripple: (1.0 - weight) * error + weight * ripple)


def _or_failed(score: Score, value: Callable[[float, float], float]) -> float:
    """Return a value of the logarithms of error and ripple; more if limits are exceeded."""
    if score.flown < 1.0:
        return FAILED - score.flown
    number = value(math.log(score.error), math.log(max(score.ripple, 1e-12)))
    number += SATURATION_WEIGHT * max(0.0, score.saturation - ALLOWED_SATURATION)
    return number + (FAILED / 2.0 if score.beyond else 0.0)


def search_front(
    trials: Trials,
    space: SearchSpace,
    allowed: float,
    evaluations: int,
    seed: int,
    weights: Sequence[float] = RIPPLE_WEIGHTS,
) -> Front:
    """Search the front of a law.

    Args:
        trials: that are flown with each gain set.
        space: of the gains.
        allowed: ripple, as a share of the largest torque.
        evaluations: gain sets to try, in all.
        seed: of the search.
        weights: of the ripple, see the module.
    """
    import cma  # slow to import
    from scipy.stats import qmc

    front = Front(trials.law.name, [])

    def fly(points: Sequence[Array]) -> list[Score]:
        scores = trials.fly([space.at(point) for point in points])
        front.tried.extend(map(Tried, points, scores))
        return scores

    spread = qmc.Sobol(space.dimension, seed=np.random.default_rng(seed)).random(FIRST_DESIGN)
    fly([space.origin, *spread[1:]][:evaluations])
    goals: list[Callable[[Score], float]] = [partial(least_error, allowed=allowed)]
    goals += [partial(weighted, weight=weight) for weight in weights]
    for number, goal in enumerate(goals):
        begin = min(front.tried, key=lambda tried: goal(tried.score))
        strategy = cma.CMAEvolutionStrategy(
            np.clip(begin.point, 0.02, 0.98),
            NEXT_STEP if number else FIRST_STEP,
            {
                "bounds": [0.0, 1.0],
                "popsize": POPULATION,
                "randn": partial(_normal, np.random.default_rng([seed, number])),
                "seed": np.nan,
                "verbose": -9,
            },
        )
        rest = (1.0 - FIRST_PART) / len(weights) if weights else 0.0
        until = evaluations * (FIRST_PART + number * rest if weights else 1.0)
        while len(front.tried) < until and not strategy.stop():
            points = strategy.ask()
            strategy.tell(points, [goal(score) for score in fly(points)])
    return front


def _normal(random: np.random.Generator, *shape: int) -> Array:
    return random.standard_normal(shape)
