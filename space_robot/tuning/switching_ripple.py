"""Ripple of the torque by noise while a robot is held still, with the switching terms of a law.

What noise becomes in ``g sign(s)`` and in the roots of super-twisting and of the terminal sliding
mode depends on its size, so the law itself runs, tick by tick, on a rigid robot near a posture. The
lag of the navigation is not in the loop.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import Signals, find_law
from space_robot_control.laws.base import NOMINAL_INERTIA, force_of

from .closed_loop import rigid_motion
from .held_ripple import SETTLING
from .linear_law import assumed_inertia
from .task import TuningTask

Array = NDArray[np.float64]


def switching_ripple(
    task: TuningTask, name: str, gains: Mapping[str, Array], weight: float
) -> Array:
    """Return the ripple (m,) of a law's force at the start of the mission, N m.

    Args:
        task: with noise.
        name: of a law with time-delay estimation.
        gains: of the law.
        weight: of the low-pass of the time-delay pair.
    """
    assert task.noise
    law, posture, noise = find_law(name)(gains, task.period), task.postures[0], task.noise
    axes, motion = posture.axes, rigid_motion(task.inertia[0], posture, task.period)
    estimate = assumed_inertia(law, posture)
    assert estimate is not None
    signals = Signals.view(Signals.block(posture.robot.n))
    signals.nominal.inertia[-axes:, -axes:] = posture.inertia
    is_as_measured = law.estimate == NOMINAL_INERTIA
    rates_of_pair = noise.measured_rates if is_as_measured else noise.rates
    state, force, smooth_force, smooth, last = np.zeros(2 * axes), *np.zeros((4, axes))
    forces = np.empty((len(noise.rates), axes))
    for k in range(len(forces)):
        own = rates_of_pair[k, -axes:] + state[axes:]
        change = np.zeros(axes) if k == 0 else (own - last) / task.period
        last = own
        smooth_force = smooth_force + weight * (force - smooth_force)
        smooth = smooth + weight * (change - smooth)
        signals.error[-axes:] = noise.errors[k, -axes:] - state[:axes]
        signals.error_rate[-axes:] = -noise.rates[k, -axes:] - state[axes:]
        signals.n_hat[-axes:] = smooth_force - estimate @ smooth
        force = force_of(law, signals, k)[-axes:].copy()
        forces[k] = force
        state = motion.step @ state + motion.by_force @ force
    deviation: Array = forces[len(forces) // SETTLING :].std(axis=0)
    return deviation
