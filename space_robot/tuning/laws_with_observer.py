"""Gains of active disturbance rejection, `adrc`.

Its observer has three equal poles, so the disturbance passes ``omega_o^3 / (s + omega_o)^3``: a lag
of ``3 / omega_o``, and with the inertia J the characteristic polynomial along an eigenvector of
``H_S^-1 J`` is ``(s + omega_o)^3 = (1 - lambda) omega_o^3``. It is stable for lambda below 9 at any
omega_o (Routh), and has a damping ratio of 0.15 for 5.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import find_law

from .closed_loop import RigidLoop
from .estimate_design import EstimateDesign
from .held_ripple import law_ripple
from .laws_with_estimate import eigenvalue_lines
from .linear_law import linear_law
from .postures import Posture
from .spectrum import eigenvalues
from .task import SEPARATION, TunedLaw, TuningTask

Array = NDArray[np.float64]

MOST_EIGENVALUE = 5.0
"""Largest eigenvalue of ``H_S^-1 J`` with the lightest masses, see the module."""
BESIDE_SPRINGS = 0.5
"""Factor on it for a robot with gears, whose springs the observer otherwise excites."""
ROUNDS = 12
"""In which omega_o of each axis approaches the ripple allowed; the noise grows with its cube."""
POSTURES = 6
"""In which the loop is checked."""
SLOWER, STEPS = 0.8, 20
"""Factor by which the controller is slowed down while the loop is unstable, and how often."""


def tune_adrc(task: TuningTask, design: EstimateDesign) -> TunedLaw:
    """Return J of the constant estimate, omega_o of its lag or slower by the noise, and omega_c.

    Args:
        task: requirements.
        design: of the estimate with a constant inertia.
    """
    largest = float(eigenvalues(task.inertia, design.h_bar).max())
    largest /= 1.0 - task.wishes.mass_uncertainty
    most = MOST_EIGENVALUE * (BESIDE_SPRINGS if task.has_gears else 1.0)
    share = min(1.0, most / largest)
    inertia, margin = share * design.h_bar, share * task.wishes.margin

    def gains_at(omega_o: Array, slower: float = 1.0) -> dict[str, Array]:
        pole = margin / (3.0 / omega_o + task.lag)
        wanted = pole / SEPARATION
        if task.wishes.bandwidth:
            wanted = np.full_like(omega_o, task.wishes.bandwidth)
        omega_c = slower * np.minimum(wanted, omega_o / SEPARATION)
        return {"inertia": inertia, "omega_c": omega_c, "omega_o": omega_o}

    omega_o = np.full_like(inertia, 3.0 * design.weight / task.period)
    if task.noise and task.noise.errors.any():
        for _ in range(ROUNDS):
            excess = law_ripple(task, "adrc", gains_at(omega_o)) / task.allowed
            if np.all(excess <= 1.0):
                break
            omega_o = omega_o * np.minimum(1.0, 0.99 * excess ** (-1.0 / 3.0))
    for step in range(STEPS):
        gains = gains_at(omega_o, SLOWER**step)
        if _is_stable(task, gains, margin):
            break
    remarks = eigenvalue_lines(task, replace(design, h_bar=inertia))
    return TunedLaw(gains, float(gains["omega_c"].min()), remarks)


def _is_stable(task: TuningTask, gains: dict[str, Array], margin: float) -> bool:
    """Return True if the loop is stable, for the heaviest and lightest robot.

    The torque may be reported too large by half of the ``margin``.
    """
    share = task.wishes.mass_uncertainty
    law = find_law("adrc")(gains, task.period)
    every = -(-len(task.postures) // POSTURES)
    inertia, postures = task.inertia[::every], _repeated(task, every)
    linear = [linear_law(law, postures[0])] * len(postures)
    return all(
        RigidLoop(factor * inertia, postures, linear, 1.0).is_stable(reported)
        for factor in (1.0 + share, 1.0 - share)
        for reported in (1.0, 1.0 + 0.5 * margin)
    )


def _repeated(task: TuningTask, every: int) -> list[Posture]:
    count = len(task.inertia)
    return [task.postures[index % len(task.postures)] for index in range(0, count, every)]
