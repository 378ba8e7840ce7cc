"""Gains of the laws with time-delay estimation, and of the observer that equals it."""

from __future__ import annotations

import numpy as np

from .estimate_design import K_1_FACTOR, EstimateDesign
from .spectrum import eigenvalues
from .task import TunedLaw, TuningTask, critical

MOST_WEIGHT = 0.9
"""Largest weight of an observer's low-pass: that of 1 has no finite bandwidth."""


def tune_tde_smc(task: TuningTask, design: EstimateDesign) -> TunedLaw:
    """Return ``lambda = W`` and g, the smallest that can hold the surface."""
    slope = np.full_like(design.gap, design.bandwidth)
    return TunedLaw({"h_bar": design.h_bar, "lambda": slope, "g": design.gap}, design.bandwidth)


def tune_tde_tsmc(task: TuningTask, design: EstimateDesign) -> TunedLaw:
    """Return K_1 that balances eps at ``|s| = eps / W``, and poles at W."""
    poles = critical(design.bandwidth, len(design.gap))
    rough = design.bandwidth * design.error
    return TunedLaw({"h_bar": design.h_bar, **poles, "k_1": np.sqrt(rough)}, design.bandwidth)


def tune_tde_stc(task: TuningTask, design: EstimateDesign) -> TunedLaw:
    """Return ``K_2 = 1.1 L`` of Levant (1998), K_1 with the paper's ``K_1^2 > 4 K_2``."""
    rough = design.bandwidth * design.error
    gains = {
        "h_bar": design.h_bar,
        "lambda": np.full_like(rough, design.bandwidth),
        "k_1": K_1_FACTOR * np.sqrt(rough),
        "k_2": 1.1 * rough,
    }
    return TunedLaw(gains, design.bandwidth)


def tune_indi(task: TuningTask, design: EstimateDesign, bandwidth: float | None = None) -> TunedLaw:
    """Return poles at W with the nominal inertia and the low-pass of the set.

    Args:
        task: requirements.
        design: of the estimate with the nominal inertia.
        bandwidth: W; None: that of the design.
    """
    bandwidth = bandwidth or design.bandwidth
    remarks = [
        f"Eigenvalues of H_S^-1 H^ {design.smallest:.3g} to {design.largest:.3g}, "
        f"the estimate lags by {design.delay * 1e3:.3g} ms."
    ]
    if task.noise:
        noise = task.noise.nominal_force(design.weight, task.nominal)
        if (excess := float((noise / task.allowed).max())) > 1.0:
            remarks.append(
                f"With the low-pass of this set its estimate has {excess:.1f} times the ripple "
                "allowed; --h-bar nominal makes a set with a slower one."
            )
    return TunedLaw(critical(bandwidth, len(design.gap)), bandwidth, remarks)


def tune_dob(task: TuningTask, design: EstimateDesign) -> TunedLaw:
    """Return the observer that equals the estimate with a constant inertia: same J, same weight."""
    weight = min(design.weight, MOST_WEIGHT)
    bandwidth = min(design.bandwidth, 2.0 * design.fastest)
    observer = np.full_like(design.h_bar, weight / (1.0 - weight) / task.period)
    gains = {"inertia": design.h_bar, "bandwidth": observer, **critical(bandwidth, len(observer))}
    return TunedLaw(gains, bandwidth, eigenvalue_lines(task, design))


def eigenvalue_lines(task: TuningTask, design: EstimateDesign) -> list[str]:
    """Return what a file says of the inertia of an observer."""
    eigen = eigenvalues(task.inertia, design.h_bar)
    return [
        f"Eigenvalues of H_S^-1 J {eigen.min():.3g} to {eigen.max():.3g}: margin "
        f"{eigen.min() / (1.0 + task.wishes.mass_uncertainty):.1%}."
    ]
