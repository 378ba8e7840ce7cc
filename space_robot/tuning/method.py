"""Tuning of a gain set for all laws, in seven steps.

1. **Shape of h_bar.** ``d_i``, the smallest inertia of axis i when all others are free,
   ``1 / (H_S^-1)_ii``, along the mission and with every payload. The ratio of the extreme
   eigenvalues of ``H_S^-1 h_bar`` is then within a factor m of the best diagonal matrix
   (van der Sluis 1969).
2. **Size of h_bar.** The smallest ``h_bar = alpha d`` that leaves the margin in torque scale (see
   `spectrum`) with a mass error mu: ``alpha min(lambda) / (1 + mu) = margin``. It is the smallest
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
6. **Laws.** ``K_P = W^2``, ``K_D = 2 W``, ``lambda = W``. The rate of eps within the bandwidth is
   ``L = W eps``. TDE-SMC: ``g = h_bar eps``, the smallest gain that can hold the surface. TDE-STC:
   ``K_2 = 1.1 L`` of Levant (1998), and ``K_1 = 2.2 L^1/2`` for the paper's ``K_1^2 > 4 K_2``.
   TDE-TSMC: ``K_1 = L^1/2``, which balances eps at ``|s| = eps / W``. CTC-SMC: g is the force that
   the nominal model does not contain; the boundary layer is that of Slotine and Li (1991, 7.2):
   inside it s decays with rate W, and not faster in any direction, ``Delta = g / (W d')`` with
   ``d'`` proportional to the shape of h_bar and ``H_S^-1 d' <= E``.
7. **Laws without h_bar.** W is that of the laws with a model, or of those with an estimate:

   - PD, with and without feedforward: ``K_D = 2 W d``, ``K_P = W^2 d``, the noise is multiplied by
     d in place of H_S.
   - Slotine and Li (1987): ``lambda = W``, ``K_D = W d``; gamma adapts with a bandwidth of W / 6
     at the largest force of the mission (`laws_with_model`); spread is mu.
   - Disturbance observer: J is h_bar, g has the weight of the pair's low-pass, so that it equals
     the time-delay estimate (`spectrum`).
   - Active disturbance rejection: J is h_bar, but with ``max(lambda) / (1 - mu) <= 5``; omega_o has
     the lag of the pair's low-pass, ``3 / omega_o``, or less noise; ``omega_c = W``, at most
     ``omega_o / 4``, and slower where the loop is not stable (`laws_with_observer`).
   - INDI: the estimate with the nominal inertia and the low-pass of the set; its W by step 4 with
     ``min(lambda) / (1 + mu)`` in place of the margin, at most that of the laws with a model.

**Gears.** H_S is also taken with the motors moving without the links behind their springs, as
within a tick (`flexible.fast_inertia`). A law with a model multiplies its K_D by the whole inertia,
so its W is lower by the largest eigenvalue of ``H_S^-1`` with that (`TuningTask.most_per_tick`).

**Nominal inertia.** With H_S of the nominal model in place of h_bar, steps 1 and 2 have nothing to
choose: lambda is near 1. The low-pass (3) has ``w max(lambda) / (1 - mu) <= 1`` and noise of
``H_S rhodd`` within the ripple, all axes together. This pair takes rates and torques as measured,
so its delay is ``delta / w``; W is as that of INDI. The errors (5) are accelerations by
``|H_S^-1| h_bar eps`` in the worst posture, times the largest share at which ``K_1^2 delta / 2``,
by which the super-twisting term switches in discrete time, remains within the allowed ripple of
the force, ``|H_S| K_1^2 delta / 2``: K_1 of one axis moves all axes here. It is used on
request, or (``auto``) where the laws with a constant h_bar would have less than a tenth of the
bandwidth of the laws with a model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import laws

from .demand import ForceDemand
from .equal_ripple import bandwidth_at_ripple, estimate_at_ripple, with_quiet_switching
from .estimate_design import (
    EstimateDesign,
    check_estimate,
    constant_estimate,
    is_weak,
    model_bandwidth,
    nominal_estimate,
    with_weight,
)
from .laws_with_estimate import tune_dob, tune_indi, tune_tde_smc, tune_tde_stc, tune_tde_tsmc
from .laws_with_model import tune_ctc, tune_ctc_smc, tune_pd, tune_slotine_li
from .laws_with_observer import tune_adrc
from .noise import Noise
from .noise_limits import low_pass_corner
from .postures import Posture
from .task import AUTO, CONSTANT, NOMINAL, TunedLaw, TuningOptions, TuningTask, axis_inertia

Array = NDArray[np.float64]

DIGITS = 3
"""Significant digits of a gain: few enough to be equal on all machines."""
WITH_ESTIMATE: Mapping[str, Callable[[TuningTask, EstimateDesign], TunedLaw]] = {
    "tde_smc": tune_tde_smc,
    "tde_tsmc": tune_tde_tsmc,
    "tde_stc": tune_tde_stc,
}
"""Laws with the estimate of the set."""
WITHOUT_ESTIMATE: Mapping[str, Callable[[TuningTask, float], TunedLaw]] = {
    "ctc": tune_ctc,
    "ctc_smc": tune_ctc_smc,
    "slotine_li": tune_slotine_li,
    "pd": tune_pd,
    "pd_feedforward": tune_pd,
}
"""Laws with W alone."""
WITHOUT_MODEL = ("pd", "pd_feedforward")
"""Those whose K_P and K_D have the inertia d in place of the model's."""


@dataclass(frozen=True)
class Tuned:
    """A gain set, with intermediate results of the method."""

    wishes: TuningOptions
    corner_hz: float
    """Corner of the low-pass of the time-delay pair, Hz."""
    delay: float
    """T of step 4, s."""
    bandwidth: float
    """W of the laws with time-delay estimation, rad/s."""
    model_bandwidth: float
    """W of the laws with a model, rad/s."""
    smallest: float
    """Smallest eigenvalue of ``H_S^-1 H^`` with nominal masses and every payload."""
    largest: float
    """Largest eigenvalue of the same."""
    error: Array
    """(m,) eps of step 5, rad/s2 (eps: 1/s2)."""
    gains: Mapping[str, Mapping[str, Array]]
    """Gains by law and name, (m,) each."""
    h_bar: str = CONSTANT
    """Inertia of the laws with time-delay estimation, `CONSTANT` or `NOMINAL`."""
    switching: float = 1.0
    """Share of the estimate's error that eps is, so that switching keeps to the ripple."""
    constant: EstimateDesign | None = None
    """The estimate with a constant h_bar, whether it is used or not."""
    bandwidths: Mapping[str, float] = field(default_factory=dict)
    """W by law, rad/s."""
    remarks: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """On the gains of some laws, for their files."""


def tune(
    inertia: Array,
    postures: Sequence[Posture],
    asked: ForceDemand,
    wishes: TuningOptions,
    period: float,
    noise: Noise | None = None,
    has_gears: bool = False,
) -> Tuned:
    """Compute a gain set.

    Args:
        inertia: (L, m, m) H_S in all configurations, with all payloads.
        postures: (K,) of the nominal robot in the same configurations; L is a multiple of K.
        asked: forces of the mission.
        wishes: the user's tuning options.
        period: delta, s.
        noise: of sensors and navigation, and its lag (None: no noise, no lag).
        has_gears: whether the inertia is also that of motors without the links behind their gears.

    Raises:
        InputError: the tuning options cannot be met together.
    """
    on_all_axes = asked.on_all_axes(axis_inertia(inertia))
    task = TuningTask(inertia, postures, on_all_axes, wishes, period, noise, has_gears)
    has_ripple = bool(wishes.noise_ripple and noise and noise.rates.any())
    constant = constant_estimate(task)
    observer = estimate_at_ripple(task, constant, True) if has_ripple else constant
    if has_ripple:
        constant = estimate_at_ripple(task, constant)
    elif has_gears:  # the low-pass is also that of `indi`, whose inertia is far above the motors'
        weight = min(constant.weight, nominal_estimate(task).weight)
        constant = with_weight(task, constant, weight)
    design, is_auto = constant, wishes.h_bar == AUTO
    if wishes.h_bar == NOMINAL or (is_auto and is_weak(constant, task)):
        design = nominal_estimate(task)
        design = estimate_at_ripple(task, design) if has_ripple else design
    check_estimate(task, design)
    tuned = {
        name: with_quiet_switching(task, name, own, design) if has_ripple else own(task, design)
        for name, own in WITH_ESTIMATE.items()
    }
    for name, tune_law in WITHOUT_ESTIMATE.items():
        if name in laws():
            most = model_bandwidth(task, task.shape if name in WITHOUT_MODEL else None)
            if has_ripple:
                most = bandwidth_at_ripple(task, name, partial(tune_law, task), most)
            tuned[name] = tune_law(task, most)
    of_model = tuned["ctc"].bandwidth
    incremental = nominal_estimate(task, design.weight)
    tuned["indi"] = tune_indi(task, incremental)
    if has_ripple and design.kind == CONSTANT:
        most = bandwidth_at_ripple(
            task,
            "indi",
            lambda bandwidth: tune_indi(task, incremental, bandwidth),
            incremental.bandwidth,
            design.weight,
        )
        tuned["indi"] = tune_indi(task, incremental, most)
    tuned["dob"] = tune_dob(task, observer)
    tuned["adrc"] = tune_adrc(task, replace(constant, weight=constant_estimate(task).weight))
    return Tuned(
        wishes,
        float(significant(low_pass_corner(design.weight, period))),
        design.delay,
        design.bandwidth,
        of_model,
        design.smallest,
        design.largest,
        design.error,
        {
            law: {name: significant(values) for name, values in own.gains.items()}
            for law, own in tuned.items()
        },
        design.kind,
        design.switching,
        constant,
        {law: own.bandwidth for law, own in tuned.items()},
        {law: own.remarks for law, own in tuned.items()},
    )


def significant(values: Array | float) -> Array:
    """Round to `DIGITS` significant digits."""
    rounded: Array = np.vectorize(lambda value: float(f"{value:.{DIGITS}g}"))(values)
    return rounded
