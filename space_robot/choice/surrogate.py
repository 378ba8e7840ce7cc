"""Surrogates of what trials show: a Gaussian process for each error and each ripple.

Errors of attitude and of each group of joints, and the ripples of their torques, depend on few of
the gains each, and smoothly, unlike their mean and their largest, of which the search is. Kernel:
Matern 5/2 with a length scale for each coordinate, of the largest marginal likelihood
(`sklearn.gaussian_process`), and white noise, since limit cycles make flights rough.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from space_robot_model.elementary.matrices import Array

from .criteria import mean_log
from .search_space import BASE, JOINTS, SearchSpace
from .trials import ALLOWED_SATURATION, Score

if TYPE_CHECKING:
    from sklearn.gaussian_process import GaussianProcessRegressor


LENGTHS, NOISE = (0.05, 20.0), (1e-6, 0.1)
"""Bounds of the length scales (of the unit cube) and of the variance of the noise (of the
values')."""
OWN_LENGTH, OTHER_LENGTH = 0.4, 4.0
"""First length scales, of gains of the same axes or all, and of the other axes."""
BASE_METRICS = ("attitude", "base_torque")
"""Beginnings of the names of errors and torques that are the base's."""
SATURATION_WEIGHT, BEYOND, FAILED = 20.0, 3.0, 1.0
"""What is added to logarithms: of the base's ripple by the share of saturation beyond the allowed
one, of the joints' by one beyond its effort or held, and of all by a flight that ended early."""

GROWTH, SLOW, UNSTABLE = "growth", 0.1, 10.0
"""Name of the process of growing motions; growth beyond which it counts by its logarithm, 1/s; what
is added to the others' predictions by it."""


class Surrogates:
    """Processes of the logarithms of all errors and ripples, refitted as trials come in."""

    def __init__(self, space: SearchSpace, allowed: float) -> None:
        """Begin without values.

        Args:
            space: that is searched.
            allowed: ripple, relative to which ripples are.
        """
        self._space, self._allowed = space, math.log(allowed)
        self._processes: dict[str, tuple[GaussianProcessRegressor, float, float]] = {}
        self._errors: tuple[str, ...] = ()

    def fit(self, points: Array, scores: Sequence[Score]) -> None:
        """Fit the processes to scores at points (N, d)."""
        self._fit(GROWTH, points, np.arcsinh([score.growth / SLOW for score in scores]))
        flown = next((score for score in scores if score.flown >= 1.0), None)
        if flown is None:
            return
        self._errors = tuple(flown.errors)
        rows = [row for row, score in enumerate(scores) if score.growth <= 0.0]
        for name in (*flown.errors, *flown.ripples):
            self._fit(name, points[rows], self._compressed(name, [scores[row] for row in rows]))

    def _fit(self, name: str, points: Array, values: Array) -> None:
        mean, scale = float(np.mean(values)), float(np.std(values)) or 1.0
        if name == GROWTH:
            mean = 0.0  # zero remains the border between stable and unstable
        process, _, _ = self._processes.get(name) or (self._new_process(name), 0.0, 1.0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a length scale at its bound: no influence
            process.fit(points, (values - mean) / scale)
        process.kernel = process.kernel_  # from which the next fit begins
        self._processes[name] = process, mean, scale

    def draw(self, random: np.random.Generator) -> dict[str, float]:
        """Draw how far each process is off its mean, in standard deviations."""
        return {name: random.standard_normal() for name in self._processes}

    def predict(self, points: Array, deviations: Mapping[str, float]) -> tuple[Array, Array]:
        """Return logarithms (N,) of error and ripple.

        Args:
            points: (N, d).
            deviations: see `draw`.
        """
        values = {}
        for name, (process, mean, scale) in self._processes.items():
            own, deviation = process.predict(points, return_std=True)
            values[name] = mean + scale * (own + deviations[name] * deviation)
        unstable = UNSTABLE * np.maximum(values.pop(GROWTH), 0.0)
        if not self._errors:
            return unstable, unstable + self._allowed
        error = mean_log({name: values.pop(name) for name in self._errors})
        return error + unstable, np.max(list(values.values()), axis=0) + self._allowed + unstable

    def _compressed(self, name: str, scores: Sequence[Score]) -> Array:
        """Return values (N,), with what is far above the useful ones brought nearer."""
        is_error = name in self._errors
        values = np.array([_value(score, name, is_error) for score in scores])
        values -= 0.0 if is_error else self._allowed
        knee = np.nanmedian(values) if is_error else max(np.nanmedian(values), 0.5)
        values = np.where(np.isnan(values), np.nanmax(values) + FAILED, values)
        compressed: Array = np.minimum(values, knee) + np.log1p(np.maximum(values - knee, 0.0))
        return compressed

    def _new_process(self, name: str) -> GaussianProcessRegressor:
        from sklearn.gaussian_process import GaussianProcessRegressor  # slow to import
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

        # gains of the base hardly move the joints, and those of the joints the base
        others = JOINTS if name.startswith(BASE_METRICS) else BASE
        lengths = [
            OTHER_LENGTH if name != GROWTH and coordinate.label.startswith(others) else OWN_LENGTH
            for coordinate in self._space.coordinates
        ]
        return GaussianProcessRegressor(
            ConstantKernel(1.0, (0.05, 50.0)) * Matern(lengths, LENGTHS, nu=2.5)
            + WhiteKernel(1e-3, NOISE)
        )


def _value(score: Score, name: str, is_error: bool) -> float:
    if score.flown < 1.0:
        return math.nan
    if is_error:
        return score.errors[name]
    ripple = score.ripples[name]
    if name.startswith(BASE_METRICS):
        return ripple + SATURATION_WEIGHT * max(0.0, score.saturation - ALLOWED_SATURATION)
    return ripple + BEYOND * (score.beyond + score.held)
