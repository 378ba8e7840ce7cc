"""Ripple of the torque by noise while a robot is held still, from linear motions.

The noise that sensors and navigation make on a robot at rest (`noise`) runs through the closed loop
of a law on a rigid robot (`closed_loop`). The lag of the navigation is not in the loop.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import find_law
from space_robot_control.laws.base import NOMINAL_INERTIA

from .closed_loop import LinearLoop, loop_of, rigid_motion
from .linear_law import linear_law
from .noise import Noise
from .task import TuningTask

Array = NDArray[np.float64]

SETTLING = 4
"""One part in so many of the noise passes before the ripple is measured."""


def law_ripple(
    task: TuningTask, name: str, gains: Mapping[str, Array], weight: float = 1.0
) -> Array:
    """Return the ripple (m,) of a law's force at the start of the mission, N m.

    Args:
        task: with noise.
        name: of the law.
        gains: of the law.
        weight: of the low-pass of the time-delay pair.
    """
    assert task.noise
    law, posture = find_law(name)(gains, task.period), task.postures[0]
    motion = rigid_motion(task.inertia[0], posture, task.period)
    loop = loop_of(motion, linear_law(law, posture), weight)
    return force_ripple(loop, task.noise, law.estimate == NOMINAL_INERTIA)


def force_ripple(loop: LinearLoop, noise: Noise, uses_measured_rates: bool) -> Array:
    """Return the standard deviation (m,) of the force, N m.

    Args:
        loop: of the law.
        noise: on all axes of the loop, the last of the robot's.
        uses_measured_rates: whether the time-delay pair has the rates as measured: with the nominal
            inertia.
    """
    axes = len(loop.force)
    of_pair = noise.measured_rates if uses_measured_rates else noise.rates
    inputs = np.hstack([x[:, -axes:] for x in (noise.errors, noise.rates, of_pair)])
    driven = inputs @ loop.by_noise.T
    states = np.empty_like(driven)
    state = np.zeros(len(loop.step))
    for k, change in enumerate(driven):
        states[k] = state
        state = loop.step @ state + change
    force = states @ loop.force.T + inputs @ loop.force_by_noise.T
    deviation: Array = force[len(force) // SETTLING :].std(axis=0)
    return deviation
