"""Gains of each law by its bandwidth W or its time-delay estimate: steps 6 and 7 of `method`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from space_robot_control.laws import find_law
from space_robot_model.elementary.matrices import Array

from .closed_loop import RigidLoop, linear_loop, rigid_motion
from .estimate_design import K_1_FACTOR, EstimateDesign
from .gain_check import eigenvalues
from .linear_law import linear_law
from .task import SEPARATION, TuningTask

MOST_WEIGHT = 0.9
"""Largest weight of an observer's low-pass: that of 1 has no finite bandwidth."""
ADAPTATION = 1.0 / 6.0
"""Bandwidth of the adaptation of masses, as a share of that of the surface."""
MOST_SPREAD = 0.9
"""Largest deviation of a body's mass that an adaptive law counts with."""
MOST_EIGENVALUE = 5.0
"""Largest eigenvalue of ``H_S^-1 J`` of `adrc` with the lightest masses, see `tune_adrc`."""
BESIDE_SPRINGS = 0.5
"""Factor on it for a robot with gears, whose springs the observer otherwise excites."""
ROUNDS = 12
"""In which omega_o of each axis approaches the ripple allowed; the noise grows with its cube."""
SETTLED = 4
"""One part in so many of the noise passes before the ripple is measured."""
POSTURES = 6
"""In which the loop is checked."""
SLOWER, STEPS = 0.8, 20
"""Factor by which the controller is slowed down while the loop is unstable, and how often."""


@dataclass(frozen=True)
class TunedLaw:
    """Gains of one law."""

    gains: Mapping[str, Array]
    """By name, (m,) each."""
    bandwidth: float
    """W, rad/s."""
    remarks: Sequence[str] = ()
    """On these gains, for their file."""


def tune_tde_smc(task: TuningTask, design: EstimateDesign) -> TunedLaw:
    """Return ``lambda = W`` and g, the smallest that can hold the surface."""
    slope = np.full_like(design.gap, design.bandwidth)
    return TunedLaw({"h_bar": design.h_bar, "lambda": slope, "g": design.gap}, design.bandwidth)


def tune_tde_tsmc(task: TuningTask, design: EstimateDesign) -> TunedLaw:
    """Return K_1 that balances eps at ``|s| = eps / W``, and poles at W."""
    poles, rough = _poles(task, design.bandwidth), design.bandwidth * design.error
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


def tune_indi(task: TuningTask, design: EstimateDesign, bandwidth: float) -> TunedLaw:
    """Return poles at W with the nominal inertia of ``design`` and the low-pass of the set."""
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
    return TunedLaw(_poles(task, bandwidth), bandwidth, remarks)


def tune_dob(task: TuningTask, design: EstimateDesign) -> TunedLaw:
    """Return the observer that equals the estimate with a constant inertia: same J, same weight."""
    weight = min(design.weight, MOST_WEIGHT)
    bandwidth = min(design.bandwidth, 2.0 * design.fastest)
    observer = np.full_like(design.h_bar, weight / (1.0 - weight) / task.period)
    gains = {"inertia": design.h_bar, "bandwidth": observer, **_poles(task, bandwidth)}
    return TunedLaw(gains, bandwidth, _eigenvalue_lines(task, design.h_bar))


def tune_adrc(task: TuningTask, design: EstimateDesign) -> TunedLaw:
    """Return J of the constant estimate, omega_o of its lag or slower by the noise, and omega_c.

    The observer has three equal poles, so the disturbance passes ``omega_o^3 / (s + omega_o)^3``: a
    lag of ``3 / omega_o``, and with the inertia J the characteristic polynomial along an
    eigenvector of ``H_S^-1 J`` is ``(s + omega_o)^3 = (1 - lambda) omega_o^3``. It is stable for
    lambda below 9 at any omega_o (Routh), and has a damping ratio of 0.15 for 5.

    Args:
        task: requirements.
        design: of the estimate with a constant inertia.
    """
    largest = float(eigenvalues(task.inertia, design.h_bar).max())
    largest /= 1.0 - task.options.mass_uncertainty
    most = MOST_EIGENVALUE * (BESIDE_SPRINGS if task.has_gears else 1.0)
    share = min(1.0, most / largest)
    inertia, margin = share * design.h_bar, share * task.options.margin

    def gains_at(omega_o: Array, slower: float = 1.0) -> dict[str, Array]:
        wanted = margin / (3.0 / omega_o + task.lag) / SEPARATION
        if task.options.bandwidth:
            wanted = np.full_like(omega_o, task.options.bandwidth)
        omega_c = slower * np.minimum(wanted, omega_o / SEPARATION)
        return {"inertia": inertia, "omega_c": omega_c, "omega_o": omega_o}

    omega_o = np.full_like(inertia, 3.0 * design.weight / task.period)
    if task.noise and task.noise.errors.any():
        for _ in range(ROUNDS):
            excess = _adrc_ripple(task, gains_at(omega_o)) / task.allowed
            if np.all(excess <= 1.0):
                break
            omega_o = omega_o * np.minimum(1.0, 0.99 * excess ** (-1.0 / 3.0))
    for step in range(STEPS):
        gains = gains_at(omega_o, SLOWER**step)
        if _adrc_is_stable(task, gains, margin):
            break
    return TunedLaw(gains, float(gains["omega_c"].min()), _eigenvalue_lines(task, inertia))


def _adrc_ripple(task: TuningTask, gains: Mapping[str, Array]) -> Array:
    """Return the ripple (m,) by noise of a robot held still at the start of the mission, N m."""
    assert task.noise
    posture, axes = task.postures[0], task.postures[0].axes
    motion = rigid_motion(task.inertia[0], posture, task.period)
    loop = linear_loop(motion, linear_law(find_law("adrc")(gains, task.period), posture), 1.0)
    errors, rates = task.noise.errors[:, -axes:], task.noise.rates[:, -axes:]
    inputs = np.hstack([errors, rates, rates])
    driven = inputs @ loop.by_noise.T
    states = np.empty_like(driven)
    state = np.zeros(len(loop.step))
    for k, change in enumerate(driven):
        states[k] = state
        state = loop.step @ state + change
    force = states @ loop.force.T + inputs @ loop.force_by_noise.T
    deviation: Array = force[len(force) // SETTLED :].std(axis=0)
    return deviation


def _adrc_is_stable(task: TuningTask, gains: dict[str, Array], margin: float) -> bool:
    """Return True if the loop is stable, for the heaviest and lightest robot.

    The torque may be reported too large by half of the ``margin``.
    """
    share = task.options.mass_uncertainty
    every = -(-len(task.postures) // POSTURES)
    rows = range(0, len(task.inertia), every)
    postures = [task.postures[row % len(task.postures)] for row in rows]
    linear = linear_law(find_law("adrc")(gains, task.period), postures[0])
    return all(
        RigidLoop(
            factor * task.inertia[::every], postures, [linear] * len(postures), 1.0
        ).is_stable(reported)
        for factor in (1.0 + share, 1.0 - share)
        for reported in (1.0, 1.0 + 0.5 * margin)
    )


def tune_ctc(task: TuningTask, bandwidth: float) -> TunedLaw:
    """Return poles at W."""
    return TunedLaw(_poles(task, bandwidth), bandwidth)


def tune_ctc_smc(task: TuningTask, bandwidth: float) -> TunedLaw:
    """Return the sliding mode for what the model does not contain.

    Slotine and Li (1991, 7.2): ``Delta = g / (W d')``, d' proportional to d, ``H_S^-1 d' <= E``.
    """
    share, demand = task.options.mass_uncertainty, task.demand
    layer = task.shape * (1.0 - share) / float(eigenvalues(task.inertia, task.shape).max())
    unknown = demand.unknown + share * demand.nominal
    gains = {
        "lambda": np.full_like(unknown, bandwidth),
        "g": unknown,
        "delta": unknown / (bandwidth * layer),
    }
    return TunedLaw(gains, bandwidth)


def tune_pd(task: TuningTask, bandwidth: float) -> TunedLaw:
    """Return ``K_D = 2 W d``, ``K_P = W^2 d``: poles at W of an axis with the others free."""
    poles = _poles(task, bandwidth)
    return TunedLaw({name: values * task.shape for name, values in poles.items()}, bandwidth)


def tune_slotine_li(task: TuningTask, bandwidth: float) -> TunedLaw:
    """Return ``lambda = W``, ``K_D = W d``, and an adaptation that is slower than the surface.

    Near a constant acceleration a the estimate acts as an integral of s with a bandwidth of
    ``(gamma a^T H_S a)^1/2``: it is at most `ADAPTATION` W at the largest force F of the mission on
    all axes at once, ``a = H_S^-1 F``. A faster one adapts to friction, which the masses cannot
    explain.
    """
    force = task.demand.nominal
    largest = float(np.max(np.linalg.solve(task.inertia, force) @ force))
    k_d, spread = bandwidth * task.shape, min(task.options.mass_uncertainty, MOST_SPREAD)
    gains = {
        "lambda": np.full_like(k_d, bandwidth),
        "k_d": k_d,
        "gamma": np.full_like(k_d, (ADAPTATION * bandwidth) ** 2 / largest),
        "spread": np.full_like(k_d, spread),
    }
    return TunedLaw(gains, bandwidth)


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


def _poles(task: TuningTask, bandwidth: float) -> dict[str, Array]:
    """Return K_P and K_D (m,) with both poles of each axis at ``bandwidth``, rad/s."""
    axes = len(task.shape)
    return {"k_p": np.full(axes, bandwidth**2), "k_d": np.full(axes, 2.0 * bandwidth)}


def _eigenvalue_lines(task: TuningTask, inertia: Array) -> list[str]:
    """Return what a file says of the ``inertia`` of an observer."""
    eigen = eigenvalues(task.inertia, inertia)
    return [
        f"Eigenvalues of H_S^-1 J {eigen.min():.3g} to {eigen.max():.3g}: margin "
        f"{eigen.min() / (1.0 + task.options.mass_uncertainty):.1%}."
    ]
