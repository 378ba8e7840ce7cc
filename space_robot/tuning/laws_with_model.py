"""Gains of the laws without an estimate: with the nominal model, or without any."""

from __future__ import annotations

import numpy as np

from .spectrum import eigenvalues
from .task import TunedLaw, TuningTask, critical

ADAPTATION_S = 10.0
"""Time in which an error of the masses is adapted at the largest force of the mission, s."""
MOST_SPREAD = 0.9
"""Largest deviation of a body's mass that an adaptive law counts with."""


def tune_ctc(task: TuningTask, bandwidth: float) -> TunedLaw:
    """Return poles at W."""
    return TunedLaw(critical(bandwidth, len(task.shape)), bandwidth)


def tune_ctc_smc(task: TuningTask, bandwidth: float) -> TunedLaw:
    """Return the sliding mode for what the model does not contain.

    Slotine and Li (1991, 7.2): ``Delta = g / (W d')``, d' proportional to d, ``H_S^-1 d' <= E``.
    """
    share, asked = task.wishes.mass_uncertainty, task.asked
    layer = task.shape * (1.0 - share) / float(eigenvalues(task.inertia, task.shape).max())
    unknown = asked.unknown + share * asked.nominal
    gains = {
        "lambda": np.full_like(unknown, bandwidth),
        "g": unknown,
        "delta": unknown / (bandwidth * layer),
    }
    return TunedLaw(gains, bandwidth)


def tune_pd(task: TuningTask, bandwidth: float) -> TunedLaw:
    """Return ``K_D = 2 W d``, ``K_P = W^2 d``: poles at W of an axis with the others free."""
    poles = critical(bandwidth, len(task.shape))
    return TunedLaw({name: values * task.shape for name, values in poles.items()}, bandwidth)


def tune_slotine_li(task: TuningTask, bandwidth: float) -> TunedLaw:
    """Return ``lambda = W``, ``K_D = W d``, and an adaptation by the force of the mission.

    A force F that is missing leaves ``s = F / K_D``, which does the work ``F^2 / K_D`` a second on
    the estimate: gamma adapts all of it in `ADAPTATION_S` at the largest force of all axes.
    """
    k_d, asked = bandwidth * task.shape, task.asked
    rate = 1.0 / (ADAPTATION_S * float(np.sum(asked.peak**2 / k_d)))
    spread = min(task.wishes.mass_uncertainty, MOST_SPREAD)
    gains = {
        "lambda": np.full_like(k_d, bandwidth),
        "k_d": k_d,
        "gamma": np.full_like(k_d, rate),
        "spread": np.full_like(k_d, spread),
    }
    return TunedLaw(gains, bandwidth)
