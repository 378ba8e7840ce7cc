"""Gains with which all laws have the same ripple by noise, for fair comparisons.

Each law has one free parameter, the largest with which no axis exceeds the share of its largest
force, by bisection of the `held_ripple` of its linear part:

- W of the laws without an estimate, and of `indi` in a set with a constant h_bar;
- the weight of the pair's low-pass of the laws with time-delay estimation, which they share, with
  that of TDE-TSMC; W follows from it by step 4 of `method`;
- the weight of `dob`, W likewise, and omega_o of `adrc`, omega_c likewise.

The laws with time-delay estimation have half of the variance by their linear part. The other half
is left to their switching terms: K_1, K_2 and g are those of an error ``c eps``, c <= 1, with which
the law itself, run on the held robot, has the ripple (`switching_ripple`).

A law remains below the share where lag or period end its range. `indi` in a set with a constant
h_bar exceeds it where its estimate does so behind the low-pass of the set, whatever W; it then has
the W of the method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .estimate_design import EstimateDesign, with_weight
from .held_ripple import law_ripple
from .laws_with_estimate import tune_dob, tune_tde_tsmc
from .noise_limits import LEAST_WEIGHT, largest_quiet
from .switching_ripple import switching_ripple
from .task import TunedLaw, TuningTask

Array = NDArray[np.float64]

LEAST_BANDWIDTH = 1e-3
"""Smallest W, rad/s."""
LEAST_SHARE = 1e-6
"""Smallest c of the switching terms."""
LINEAR_SHARE = 0.5
"""Share of the variance that the linear part of a law with switching terms has."""


def bandwidth_at_ripple(
    task: TuningTask,
    law: str,
    gains_of: Callable[[float], TunedLaw],
    most: float,
    weight: float = 1.0,
) -> float:
    """Return W of a law, rad/s, at most ``most``.

    Args:
        task: with noise.
        law: its name.
        gains_of: returns its gains for W.
        most: largest W, rad/s.
        weight: of the low-pass of the time-delay pair.
    """

    def ripple(bandwidth: float) -> Array:
        return law_ripple(task, law, gains_of(bandwidth).gains, weight)

    if np.any(ripple(LEAST_BANDWIDTH) > task.allowed):
        return most
    return _largest(task, LEAST_BANDWIDTH, most, ripple)


def estimate_at_ripple(
    task: TuningTask, design: EstimateDesign, as_observer: bool = False
) -> EstimateDesign:
    """Return an estimate with the largest weight of its low-pass, at most that of ``design``.

    Args:
        task: with noise.
        design: of the estimate.
        as_observer: for `dob` in place of the laws with time-delay estimation.
    """
    if not as_observer:
        of_linear_part = task.wishes.allowed_ripple * LINEAR_SHARE**0.5
        task = replace(task, wishes=replace(task.wishes, noise_ripple=of_linear_part))

    def ripple(weight: float) -> Array:
        own = with_weight(task, design, weight)
        if as_observer:
            return law_ripple(task, "dob", tune_dob(task, own).gains)
        return law_ripple(task, "tde_tsmc", tune_tde_tsmc(task, own).gains, weight)

    return with_weight(task, design, _largest(task, LEAST_WEIGHT, design.weight, ripple))


def with_quiet_switching(
    task: TuningTask,
    law: str,
    gains_of: Callable[[TuningTask, EstimateDesign], TunedLaw],
    design: EstimateDesign,
) -> TunedLaw:
    """Return the gains of a law with time-delay estimation and the ripple of the task.

    Args:
        task: with noise.
        law: its name.
        gains_of: returns its gains for an estimate.
        design: of the estimate.
    """

    def with_share(share: float) -> TunedLaw:
        own = replace(design, gap=share * design.gap, error=share * design.error)
        return gains_of(task, own)

    def ripple(share: float) -> Array:
        return switching_ripple(task, law, with_share(share).gains, design.weight)

    if np.any(ripple(LEAST_SHARE) > task.allowed):
        return with_share(LEAST_SHARE)
    return with_share(_largest(task, LEAST_SHARE, 1.0, ripple))


def _largest(
    task: TuningTask, low: float, high: float, ripple_of: Callable[[float], Array]
) -> float:
    """Return the largest parameter in a range with the ripple of the task."""
    if np.all(ripple_of(high) <= task.allowed):
        return high
    return largest_quiet(low, high, lambda x: ripple_of(x) / task.allowed)
