"""Inertia, low-pass, and errors of a time-delay estimate: steps 1 to 5 of `method`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.errors import InputError

from .closed_loop import bisect
from .gain_check import eigenvalues
from .task import CONSTANT, MOST_PER_TICK, NOMINAL, SEPARATION, Noise, TuningTask

K_1_FACTOR = 2.2
"""K_1 of the super-twisting term by the square root of W eps, see step 6 of `method`."""
LEAST_WEIGHT = 1e-4
"""Smallest weight of a low-pass: a corner of 0.03 Hz at 2 kHz."""
BISECTIONS = 12
"""Of a weight's logarithm: it is then more precise than the written digits."""


@dataclass(frozen=True)
class EstimateDesign:
    """A time-delay estimate, and what laws may ask of it."""

    kind: str
    """`CONSTANT` or `NOMINAL`."""
    h_bar: Array
    """(m,) kg m2; zero for the nominal inertia."""
    smallest: float
    """Smallest eigenvalue of ``H_S^-1 H^`` with nominal masses and every payload."""
    largest: float
    """Largest eigenvalue of the same."""
    weight: float
    """w of the pair's low-pass; 1: none."""
    delay: float
    """T of step 4, s."""
    fastest: float
    """The largest W, a quarter of the estimate's pole, rad/s."""
    bandwidth: float
    """W of its laws, rad/s."""
    gap: Array
    """(m,) error of the estimate in a tick, N m."""
    error: Array
    """(m,) eps, the acceleration by it, rad/s2 (eps: 1/s2)."""
    switching: float = 1.0
    """Share of the acceleration by the gap that ``error`` counts, see `_switching_share`."""


def constant_estimate(task: TuningTask) -> EstimateDesign:
    """Return the estimate with a constant diagonal inertia.

    Raises:
        InputError: the sensors are too noisy.
    """
    options, eigen = task.options, eigenvalues(task.inertia, task.shape)
    low, high = float(eigen.min()), float(eigen.max())
    size = options.margin * (1.0 + options.mass_uncertainty) / low
    weight = min(1.0, (1.0 - options.mass_uncertainty) / (size * high))
    h_bar = size * task.shape
    if task.noise:
        weight = quiet_weight(weight, task.noise.acceleration, task.allowed / h_bar)
    return _design(task, CONSTANT, h_bar, size * low, size * high, weight)


def nominal_estimate(task: TuningTask, weight: float | None = None) -> EstimateDesign:
    """Return the estimate with the inertia of the nominal model.

    Args:
        task: requirements.
        weight: of the low-pass; None: the largest one that the masses and the noise allow.

    Raises:
        InputError: the sensors are too noisy.
    """
    eigen = eigenvalues(task.inertia, task.nominal)
    low, high = float(eigen.min()), float(eigen.max())
    if weight is None:
        weight = min(1.0, (1.0 - task.options.mass_uncertainty) / high)
        if noise := task.noise:
            weight = quiet_weight(
                weight, lambda w: noise.nominal_force(w, task.nominal), task.allowed
            )
    return _design(task, NOMINAL, np.zeros_like(task.shape), low, high, weight)


def with_weight(task: TuningTask, design: EstimateDesign, weight: float) -> EstimateDesign:
    """Return the estimate with another low-pass."""
    return _design(task, design.kind, design.h_bar, design.smallest, design.largest, weight)


def _design(
    task: TuningTask, kind: str, h_bar: Array, smallest: float, largest: float, weight: float
) -> EstimateDesign:
    """Take steps 4 and 5; the pair of the nominal inertia has no lag but its own."""
    options, is_constant = task.options, kind == CONSTANT
    delay = task.period / weight + (task.lag if is_constant else 0.0)
    slowest = options.margin if is_constant else smallest / (1.0 + options.mass_uncertainty)
    fastest = slowest / delay / SEPARATION
    bandwidth = options.bandwidth or fastest
    if not is_constant and not options.bandwidth:
        bandwidth = min(fastest, model_bandwidth(task))
    gap = delay * task.demand.slope + 0.5 * options.margin * task.demand.peak
    switching = 1.0
    if is_constant:
        error = gap / h_bar
    else:
        error = (np.abs(np.linalg.inv(task.inertia)) @ gap).max(axis=0)
        switching = _switching_share(task, bandwidth * error)
    forces = gap, switching * error, switching
    return EstimateDesign(
        kind, h_bar, smallest, largest, weight, delay, fastest, bandwidth, *forces
    )


def _switching_share(task: TuningTask, rough: Array) -> float:
    """Return the share of ``W eps`` (m,) at which switching keeps to the allowed ripple, at most 1.

    In discrete time the super-twisting term of an axis switches by about ``K_1^2 delta / 2``. With
    the nominal inertia the force of each axis is H_S times that of all axes.
    """
    step = 0.5 * K_1_FACTOR**2 * task.period * rough
    ripple = (np.abs(task.nominal) @ step).max(axis=0)
    return float(np.min(task.allowed / ripple, initial=1.0))


def check_estimate(task: TuningTask, design: EstimateDesign) -> None:
    """Check margin and bandwidth that a user asks for.

    Raises:
        InputError: the margin is beyond what the nominal inertia leaves, or the bandwidth beyond
            half of the estimate's pole.
    """
    options, smallest = task.options, design.smallest / (1.0 + task.options.mass_uncertainty)
    if design.kind == NOMINAL and smallest < options.margin:
        raise InputError(
            f"margin must be at most {smallest:.3g} with the nominal inertia, this mass "
            f"uncertainty and these payloads, got {options.margin:g}"
        )
    if design.bandwidth > 2.0 * design.fastest:
        raise InputError(
            f"bandwidth must be at most {2.0 * design.fastest:.3g} rad/s, half of the pole of an "
            f"estimate with this margin and lag, got {design.bandwidth:g}"
        )


def model_bandwidth(task: TuningTask, own: Array | None = None) -> float:
    """Return W of a law without estimate, rad/s: what lag, period and noise allow.

    Args:
        task: with its lag and noise.
        own: (m,) inertia by which the law multiplies K_P and K_D; None: that of the model.
    """
    if task.options.bandwidth:
        return task.options.bandwidth
    most = MOST_PER_TICK
    if own is None:
        own = np.diagonal(task.inertia, axis1=1, axis2=2).max(axis=0)
        most = task.most_per_tick
    bandwidth = min(quiet_bandwidth(own, task.noise, task.allowed), most / task.period)
    return min(bandwidth, 1.0 / SEPARATION / task.lag) if task.lag else bandwidth


def quiet_weight(largest: float, noise: Callable[[float], Array], most: Array) -> float:
    """Return the largest weight of a low-pass, at most ``largest``, with noise up to ``most`` (m,).

    Args:
        largest: weight.
        noise: (m,) with a weight, with which it grows.
        most: in the unit of the noise.

    Raises:
        InputError: there is no such weight.
    """

    def is_quiet(logarithm: float) -> bool:
        return bool(np.all(noise(math.exp(logarithm)) <= most))

    if np.any(noise(LEAST_WEIGHT) > most):
        raise InputError("no low-pass reduces the noise of these sensors enough: allow more ripple")
    if np.all(noise(largest) <= most):
        return largest
    return math.exp(bisect(math.log(LEAST_WEIGHT), math.log(largest), is_quiet, BISECTIONS))


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
