"""Gains of the laws without an estimate: with the nominal model, or without any."""

from __future__ import annotations

import numpy as np

from .spectrum import eigenvalues
from .task import TunedLaw, TuningTask, critical

ADAPTATION = 1.0 / 6.0
"""Bandwidth of the adaptation of masses, as a share of that of the surface."""
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
    """Return ``lambda = W``, ``K_D = W d``, and an adaptation that is slower than the surface.

    Near a constant acceleration a the estimate acts as an integral of s with a bandwidth of
    ``(gamma a^T H_S a)^1/2``: it is at most `ADAPTATION` W at the largest force F of the mission on
    all axes at once, ``a = H_S^-1 F``. A faster one adapts to friction, which the masses cannot
    explain.
    """
    force = task.asked.nominal
    largest = float(np.max(np.linalg.solve(task.inertia, force) @ force))
    k_d, spread = bandwidth * task.shape, min(task.wishes.mass_uncertainty, MOST_SPREAD)
    gains = {
        "lambda": np.full_like(k_d, bandwidth),
        "k_d": k_d,
        "gamma": np.full_like(k_d, (ADAPTATION * bandwidth) ** 2 / largest),
        "spread": np.full_like(k_d, spread),
    }
    return TunedLaw(gains, bandwidth)
