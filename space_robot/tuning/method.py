"""Tuning of a gain set for all laws, in six steps.

1. **Shape of h_bar.** ``d_i``, the smallest inertia of axis i when all others are free,
   ``1 / (H_S^-1)_ii``, along the mission and with every payload. The ratio of the extreme
   eigenvalues of ``H_S^-1 h_bar`` is then within a factor m of the best diagonal matrix
   (van der Sluis 1969).
2. **Size of h_bar.** The smallest ``h_bar = alpha d`` that leaves the margin in torque scale (see
   `gain_check`) with a mass error mu: ``alpha min(lambda) / (1 + mu) = margin``. It is the smallest
   because noise is proportional to h_bar.
3. **Low-pass of the time-delay pair.** The largest eigenvalue may then exceed 1 or even 2. With a
   low-pass of weight w the estimate's error is multiplied by ``1 - w lambda`` per tick. w is the
   largest weight for which this factor is not negative, ``w alpha max(lambda) / (1 - mu) <= 1``,
   and for which the noise, h_bar times that of the pair's acceleration (`noise`), is within the
   allowed ripple: a share of the largest force of the axis along the mission.
4. **Bandwidth.** The estimate is delayed by ``T = delta / w`` plus the lag of the navigation: the
   acceleration of an axis follows its command with a pole at ``margin / T`` rad/s in the slowest
   direction. With poles at W the loop is ``s^3 / p + s^2 + 2 W s + W^2``, whose complex pair has
   a damping of 0.7 for ``W = p / 4``. Ripple and bandwidth are both proportional to margin / T:
   more margin needs a slower low-pass, more bandwidth gives more ripple. Computed torque uses no
   estimate. Its W is four times slower than the navigation's lag, at most `MOST_PER_TICK`, and
   within the allowed ripple: it multiplies the noise of rate and angle by ``H_S (2 W, W^2)``.
5. **Errors of the estimate.** Within a tick the estimate has the error
   ``h_bar eps = T dF_S/dt + (1 - b) F_S``, with b the reported share of the torque, assumed wrong
   by half of the margin. F_S is that of inverse dynamics along the mission.
6. **Laws.** ``K_P = W^2``, ``K_D = 2 W``, ``lambda = W``; W is that of the laws with a model, or of
   those with an estimate. `law_gains` has the rules of each law.

**Gears.** H_S is also taken with the motors moving without the links behind their springs, as
within a tick (`flexible.fast_inertia`). A law with a model multiplies its K_D by the whole inertia,
so its W is lower by the largest eigenvalue of ``H_S^-1`` with that (`TuningTask.most_per_tick`).

**Nominal inertia.** With H_S of the nominal model in place of h_bar, steps 1 and 2 have nothing to
choose: lambda is near 1. The low-pass (3) has ``w max(lambda) / (1 - mu) <= 1`` and noise of
``H_S rhodd`` within the ripple, all axes together. This pair takes rates and torques as measured,
so its delay is ``delta / w``; W is as that of INDI. The errors (5) are accelerations by
``|H_S^-1| h_bar eps`` in the worst posture, times the largest share at which ``K_1^2 delta / 2``,
by which the super-twisting term switches in discrete time, remains within the allowed ripple of
the force, ``|H_S| K_1^2 delta / 2``: K_1 of one axis moves all axes here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from space_robot_control.laws import laws
from space_robot_model.elementary.matrices import Array

from .estimate_design import (
    EstimateDesign,
    check_estimate,
    constant_estimate,
    model_bandwidth,
    nominal_estimate,
    with_weight,
)
from .inertia import Posture
from .law_gains import (
    WITH_ESTIMATE,
    WITHOUT_ESTIMATE,
    WITHOUT_MODEL,
    TunedLaw,
    tune_adrc,
    tune_dob,
    tune_indi,
)
from .task import NOMINAL, ForceDemand, Noise, TuningOptions, TuningTask, axis_inertia

DIGITS = 3
"""Significant digits of a gain: few enough to be equal on all machines."""


@dataclass(frozen=True)
class Tuned:
    """A gain set, with intermediate results of the method."""

    options: TuningOptions
    design: EstimateDesign
    """The time-delay estimate of the set."""
    constant: EstimateDesign
    """The estimate with a constant h_bar, whether it is used or not."""
    corner_hz: float
    """Corner of the low-pass of the time-delay pair, Hz."""
    laws: Mapping[str, TunedLaw]
    """Gains, rounded, by law."""

    @property
    def model_bandwidth(self) -> float:
        """W of the laws with a model, rad/s."""
        return self.laws["ctc"].bandwidth


def tune(
    inertia: Array,
    postures: Sequence[Posture],
    demand: ForceDemand,
    options: TuningOptions,
    period: float,
    noise: Noise | None = None,
    has_gears: bool = False,
) -> Tuned:
    """Compute a gain set.

    Args:
        inertia: (L, m, m) H_S in all configurations, with all payloads.
        postures: (K,) of the nominal robot in the same configurations; L is a multiple of K.
        demand: forces of the mission.
        options: requirements of the user.
        period: delta, s.
        noise: of sensors and navigation, and its lag (None: no noise, no lag).
        has_gears: whether the inertia is also that of motors without the links behind their gears.

    Raises:
        InputError: the requirements cannot be met together.
    """
    on_all_axes = demand.on_all_axes(axis_inertia(inertia))
    task = TuningTask(inertia, postures, on_all_axes, options, period, noise, has_gears)
    constant = first = constant_estimate(task)
    if has_gears:  # the low-pass is also that of `indi`, whose inertia is far above the motors'
        constant = with_weight(task, first, min(first.weight, nominal_estimate(task).weight))
    design = constant
    if options.h_bar == NOMINAL:
        design = nominal_estimate(task)
    check_estimate(task, design)
    tuned = {name: rule(task, design) for name, rule in WITH_ESTIMATE.items()}
    for name, simple_rule in WITHOUT_ESTIMATE.items():
        if name in laws():
            own = task.shape if name in WITHOUT_MODEL else None
            tuned[name] = simple_rule(task, model_bandwidth(task, own))
    incremental = nominal_estimate(task, design.weight)
    tuned["indi"] = tune_indi(task, incremental, incremental.bandwidth)
    tuned["dob"] = tune_dob(task, first)
    tuned["adrc"] = tune_adrc(task, replace(constant, weight=first.weight))
    weight = design.weight
    corner = 0.0 if weight >= 1.0 else -math.log(1.0 - weight) / (2.0 * math.pi * period)
    rounded = {
        name: replace(law, gains={key: significant(values) for key, values in law.gains.items()})
        for name, law in tuned.items()
    }
    return Tuned(options, design, constant, float(significant(corner)), rounded)


def significant(values: Array | float) -> Array:
    """Round to `DIGITS` significant digits."""
    rounded: Array = np.vectorize(lambda value: float(f"{value:.{DIGITS}g}"))(values)
    return rounded
