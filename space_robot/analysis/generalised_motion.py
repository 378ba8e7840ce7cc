"""A flight in the coordinates of the laws, ``rho = [eps, theta]``: its rates and forces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]


def measured_rows(log: FlightLog, before: FlightLog | None = None) -> NDArray[np.bool_]:
    """(N,) true where a tick's state was measured: one that was filled in repeats the one before.

    ``before``: rows before those of ``log`` (None: the flight begins with it).
    """
    there = np.ones(log.ticks, dtype=bool)
    if log.filled:
        state = _state(log)
        last = state[:1] + np.nan if before is None else _state(before)[-1:]
        there = np.any(np.diff(state, axis=0, prepend=last) != 0.0, axis=1)
    return there


def _state(log: FlightLog) -> Array:
    return np.hstack([log.quaternion, log.omega_base, log.joint_positions])


def continuous_quaternion(log: FlightLog) -> Array:
    """(N, 4) the attitude without jumps between Q and -Q, as the controller takes it."""
    q = log.quaternion
    flips = np.sum(q[1:] * q[:-1], axis=1) < 0.0
    if not flips.any():
        return q
    sides = np.concatenate([[1.0], np.where(flips, -1.0, 1.0)]).cumprod()
    continuous: Array = sides[:, np.newaxis] * q
    return continuous


def rate(log: FlightLog) -> Array:
    """(N, m) ``rhodot = [J0 omega_base, thetadot]`` (22), with J0 of (1)."""
    quaternion = continuous_quaternion(log)
    eta, eps = quaternion[:, :1], quaternion[:, 1:]
    epsdot = 0.5 * (eta * log.omega_base + np.cross(eps, log.omega_base))
    return np.hstack([epsdot, log.joint_velocities])


def mean_acceleration(log: FlightLog) -> Array:
    """(N-1, m) mean rhodd over the interval that begins at each tick."""
    return np.diff(rate(log), axis=0) / log.timebase.period


def applied_force(log: FlightLog) -> Array:
    """(N-1, m) ``F_S = J^-T tau`` over the interval that begins at each tick.

    ``J0^-T = 2 (eta E + skew(eps) + eps eps^T / eta)``, J0 that of the tick.
    """
    force = log.applied_torque[1:].copy()
    quaternion, torque = continuous_quaternion(log)[:-1], log.applied_torque[1:, :3]
    eta, eps = quaternion[:, :1], quaternion[:, 1:]
    along = np.sum(eps * torque, axis=1, keepdims=True)
    force[:, :3] = 2.0 * (eta * torque + np.cross(eps, torque) + eps * along / eta)
    return force


def neglected_force(log: FlightLog, h_bar: Array) -> Array:
    """Compute ``N = F_S - h_bar rhodd`` (33), (N-1, m), over the interval of each tick.

    N m on the joints, of prismatic ones N; on the base the generalised force that belongs to eps,
    twice the torque where the attitude is small.
    """
    return applied_force(log) - h_bar * mean_acceleration(log)
