"""Ripple of the torque by noise: what it allows, and what a law makes of it on a robot held still.

The noise that sensors and navigation make on a robot at rest (`noise`) runs through the closed loop
of a law on a rigid robot (`closed_loop`). What it becomes in ``g sign(s)`` and in the roots of
super-twisting and of the terminal sliding mode depends on its size, so there the law itself runs,
tick by tick. The lag of the navigation is not in the loop.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import Signals, find_law
from space_robot_control.laws.base import NOMINAL_INERTIA, ControlLaw, force_of
from space_robot_msgs_py.errors import InputError

from .closed_loop import bisect, linear_loop, rigid_motion
from .linear_law import assumed_inertia, linear_law
from .noise import Noise
from .task import TuningTask

Array = NDArray[np.float64]

SETTLING = 4
"""One part in so many of the noise passes before the ripple is measured."""
LEAST_WEIGHT = 1e-4
"""Smallest weight of a low-pass: a corner of 0.03 Hz at 2 kHz."""
BISECTIONS = 12
"""Of a parameter's logarithm: it is then more precise than the written digits."""


def largest_quiet(low: float, high: float, ripple: Callable[[float], Array], most: Array) -> float:
    """Return the largest parameter in a range with a ripple of at most ``most`` (m,).

    Args:
        low: the result where no parameter is quiet enough.
        high: largest parameter.
        ripple: (m,) with a parameter, with which it grows.
        most: in the unit of the ripple.
    """
    if np.all(ripple(high) <= most):
        return high
    is_quiet = lambda x: bool(np.all(ripple(math.exp(x)) <= most))  # noqa: E731
    return math.exp(bisect(math.log(low), math.log(high), is_quiet, BISECTIONS))


def quiet_weight(largest: float, noise: Callable[[float], Array], most: Array) -> float:
    """Return the largest weight of a low-pass, at most ``largest``, as `largest_quiet`.

    Raises:
        InputError: there is no such weight.
    """
    if np.any(noise(LEAST_WEIGHT) > most):
        raise InputError("no low-pass reduces the noise of these sensors enough: allow more ripple")
    return largest_quiet(LEAST_WEIGHT, largest, noise, most)


def quiet_bandwidth(own: Array, noise: Noise | None, allowed: Array) -> float:
    """Return the largest W, rad/s, with noise up to ``allowed`` (m,), N m, of a law without lag.

    ``own^2 (4 W^2 sigma_rate^2 + W^4 sigma_e^2) = allowed^2`` on the limiting axis; ``own`` (m,) is
    the inertia by which the law multiplies K_P and K_D, kg m2.
    """
    if noise is None or not noise.rates.any():
        return math.inf
    rate, angle = 2.0 * own * noise.rates.std(axis=0), own * noise.errors.std(axis=0)
    root = np.sqrt(rate**4 + 4.0 * (angle * allowed) ** 2)
    with np.errstate(divide="ignore"):
        squares = 2.0 * allowed**2 / (rate**2 + root)
    return float(np.sqrt(squares.min()))


def linear_ripple(
    task: TuningTask, name: str, gains: Mapping[str, Array], weight: float = 1.0
) -> Array:
    """Return the ripple (m,) of the linear part of a law at the start of the mission, N m.

    Args:
        task: with noise.
        name: of the law.
        gains: of the law.
        weight: of the low-pass of the time-delay pair.
    """
    law, posture = find_law(name)(gains, task.period), task.postures[0]
    motion = rigid_motion(task.inertia[0], posture, task.period)
    loop = linear_loop(motion, linear_law(law, posture), weight)
    inputs = np.hstack(_noise_of(task, law))
    forced = inputs @ loop.by_noise.T
    states = np.empty_like(forced)
    state = np.zeros(len(loop.step))
    for k, change in enumerate(forced):
        states[k] = state
        state = loop.step @ state + change
    return _deviation(states @ loop.force.T + inputs @ loop.force_by_noise.T)


def switching_ripple(
    task: TuningTask, name: str, gains: Mapping[str, Array], weight: float
) -> Array:
    """Return the same of a whole law with time-delay estimation."""
    law, posture = find_law(name)(gains, task.period), task.postures[0]
    axes, motion = posture.axes, rigid_motion(task.inertia[0], posture, task.period)
    estimate = assumed_inertia(law, posture)
    assert estimate is not None
    signals = Signals.view(Signals.block(posture.robot.n))
    signals.nominal.inertia[-axes:, -axes:] = posture.inertia
    errors, rates, rates_of_pair = _noise_of(task, law)
    state, force, smooth_force, smooth, last = np.zeros(2 * axes), *np.zeros((4, axes))
    forces = np.empty((len(rates), axes))
    for k in range(len(forces)):
        own = rates_of_pair[k] + state[axes:]
        change = np.zeros(axes) if k == 0 else (own - last) / task.period
        last = own
        smooth_force = smooth_force + weight * (force - smooth_force)
        smooth = smooth + weight * (change - smooth)
        signals.error[-axes:] = errors[k] - state[:axes]
        signals.error_rate[-axes:] = -rates[k] - state[axes:]
        signals.n_hat[-axes:] = smooth_force - estimate @ smooth
        force = force_of(law, signals, k)[-axes:].copy()
        forces[k] = force
        state = motion.step @ state + motion.by_force @ force
    return _deviation(forces)


def _noise_of(task: TuningTask, law: ControlLaw) -> tuple[Array, Array, Array]:
    """Return (K, m) e, rhodot, and the rhodot that the law's time-delay pair takes."""
    noise, axes = task.noise, task.postures[0].axes
    assert noise
    pair_rates = noise.measured_rates if law.estimate == NOMINAL_INERTIA else noise.rates
    return noise.errors[:, -axes:], noise.rates[:, -axes:], pair_rates[:, -axes:]


def _deviation(force: Array) -> Array:
    deviation: Array = force[len(force) // SETTLING :].std(axis=0)
    return deviation
