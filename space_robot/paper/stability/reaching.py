"""Finite-time reaching (53)-(56): a flight from an initial error, compared with its bound.

The state of (46) is ``eta = [|s|^1/2 sign(s), psi]``. Its psi is *not* the integral in the law
(42), which appears on the other side of (44): ``psi = eps - integral of K_2 sign(s)``, hence
``psidot = -K_2 sign(s) + epsdot`` (45). Here it is measured by the first line of (46),
``psi = sdot + K_1 |s|^1/2 sign(s)``, with sdot the mean over a tick.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog

from ...flight.plan import Flight, Scenario

Array = NDArray[np.float64]

REACHED = 0.01
"""Share of |s(0)| below which the sliding surface counts as reached."""
RIPPLE_PERCENTILE = 99.9
"""Percentile of |s| in a flight without initial error that defines the ripple of s, %."""
DWELL = 1.0
"""Time for which |s| must stay small, s; later, friction may push a joint off the surface."""


@dataclass(frozen=True)
class Reaching:
    """Reaching phase of a flight from an initial error, per axis."""

    time: Array
    """(K,) time, s."""
    eta: Array
    """(K, m, 2) state of (46)."""
    threshold: Array
    """(m,) |s| below which the surface counts as reached, rad/s (eps: 1/s)."""
    measured: Array
    """(m,) reaching time, s; NaN if the surface was not reached."""


def off_mission_plan(flight: Flight, initial_error: float) -> Scenario:
    """Return the plan of ``flight``, started at rest with ``e = initial_error`` on every axis."""
    start = flight.mission.chunk(0, 1)
    eps = start.base[0, 1:4] - initial_error
    eta = np.copysign(np.sqrt(1.0 - eps @ eps), start.base[0, 0])
    plant: dict[str, Any] = {
        "initial_quaternion": [float(eta), *eps.tolist()],
        "initial_joints_deg": flight.robot.to_degrees(start.joints[0, 0] - initial_error).tolist(),
    }
    return flight.scenario.options.with_parameters("plant", plant)


def ripple(s: Array) -> Array:
    """Return a high percentile (m,) of |``s``| (N, m): the ripple caused by sampling."""
    return np.asarray(np.percentile(np.abs(s), RIPPLE_PERCENTILE, axis=0))


def lyapunov_state(s: Array, k_1: Array, period: float) -> Array:
    """Return eta of (47), (N-1, m, 2), from ``s`` (N, m) and ``k_1`` (m,)."""
    root = np.sqrt(np.abs(s[:-1])) * np.sign(s[:-1])
    psi = np.diff(s, axis=0) / period + k_1 * root
    return np.asarray(np.stack([root, psi], axis=-1))


def arrival(s: Array, threshold: Array, period: float) -> Array:
    """Return the time (m,), s, from which |s| stays below ``threshold`` for `DWELL`; or NaN."""
    ticks = max(1, round(DWELL / period))
    times = np.full(s.shape[1], np.nan)
    for axis in range(s.shape[1]):
        outside = np.flatnonzero(np.abs(s[:, axis]) > threshold[axis])
        begins = np.concatenate([[0], outside + 1])
        ends = np.concatenate([outside, [len(s)]])
        long_enough = np.flatnonzero(ends - begins >= ticks)
        if len(long_enough):
            times[axis] = begins[long_enough[0]] * period
    return times


def reaching(log: FlightLog, k_1: Array, undisturbed: Array) -> Reaching:
    """Measure when a flight from an initial error reaches the sliding surface.

    Args:
        log: the flight, with telemetry.
        k_1: (m,) K_1 of its law.
        undisturbed: (m,) `ripple` of the flight without an initial error.
    """
    if log.telemetry is None:
        raise ValueError("the reaching time needs a log with the controller's telemetry")
    s, period = log.telemetry[:, 0], log.timebase.period
    threshold = np.maximum(REACHED * np.abs(s[0]), undisturbed)
    eta = lyapunov_state(s, k_1, period)
    time = np.arange(len(eta), dtype=np.float64) * period
    return Reaching(time, eta, threshold, arrival(s, threshold, period))
