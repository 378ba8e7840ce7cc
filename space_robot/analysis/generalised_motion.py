"""A flight in the coordinates of the laws, ``rho = [eps_e, theta]``: its rates and forces.

``eps_e`` is the vector part of `attitude_error`, here of the continuous one of `continuous_error`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.robot.placements import base_axes, to_base
from space_robot_msgs_py.bag.flight_log import FlightLog

from .errors import attitude_error

Array = NDArray[np.float64]


def measured_rows(log: FlightLog, start: int, stop: int) -> NDArray[np.bool_]:
    """(stop - start,) true where a tick's state was measured: a filled one repeats that before."""
    if not log.filled:
        return np.ones(stop - start, dtype=bool)
    rows = slice(max(start - 1, 0), stop)
    state = np.hstack([log.quaternion[rows], log.omega_base[rows], log.joint_positions[rows]])
    differs = np.any(np.diff(state, axis=0) != 0.0, axis=1)
    return differs if start else np.concatenate([[True], differs])


def continuous_error(log: FlightLog) -> Array:
    """(N, 4) `attitude_error` without jumps between q_e and -q_e, as the controller takes it."""
    q = attitude_error(log)
    flips = np.sum(q[1:] * q[:-1], axis=1) < 0.0
    if not flips.any():
        return q
    sides = np.concatenate([[1.0], np.where(flips, -1.0, 1.0)]).cumprod()
    continuous: Array = sides[:, np.newaxis] * q
    return continuous


def relative_rate(log: FlightLog) -> Array:
    """(N, 3) rad/s, ``omega_e = omega - R_e^T omega_d`` on the base's axes."""
    axes = base_axes(unit_rows(attitude_error(log)).T)
    rate: Array = log.omega_base - to_base(axes, log.reference_base[:, 4:7].T).T
    return rate


def rate(log: FlightLog, error: Array) -> Array:
    """(N, m) ``rhodot = [J0(q_e) omega_e, thetadot]`` (22), with J0 of (1).

    ``error``: (N, 4) q_e, here and below.
    """
    omega, eta, eps = relative_rate(log), error[:, :1], error[:, 1:]
    epsdot = 0.5 * (eta * omega + np.cross(eps, omega))
    return np.hstack([epsdot, log.joint_velocities])


def mean_acceleration(log: FlightLog, error: Array) -> Array:
    """(N-1, m) mean rhodd over the interval that begins at each tick."""
    return np.diff(rate(log, error), axis=0) / log.timebase.period


def applied_force(log: FlightLog, error: Array) -> Array:
    """(N-1, m) ``F_S = J^-T tau`` over the interval that begins at each tick.

    ``J0^-T = 2 (eta E + skew(eps) + eps eps^T / eta)``, J0 that of the tick.
    """
    force = log.applied_torque[1:].copy()
    torque, eta, eps = log.applied_torque[1:, :3], error[:-1, :1], error[:-1, 1:]
    along = np.sum(eps * torque, axis=1, keepdims=True)
    force[:, :3] = 2.0 * (eta * torque + np.cross(eps, torque) + eps * along / eta)
    return force


def neglected_force(log: FlightLog, h_bar: Array) -> Array:
    """Compute ``N = F_S - h_bar rhodd`` (33), (N-1, m), over the interval of each tick.

    N m on the joints, of prismatic ones N; on the base the generalised force that belongs to eps_e,
    twice the torque where the attitude's error is small.
    """
    error = continuous_error(log)
    return applied_force(log, error) - h_bar * mean_acceleration(log, error)
