"""Tracking error of a flight, its groups of axes, and the waypoints of its reference."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import attitude_error_into
from space_robot_model.elementary.matrices import Array, dot_rows, norms, unit_rows
from space_robot_model.robot.placements import base_axes, to_base
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.kernels import kernel

AxisIndex = slice | list[int]
"""Some of the n+3 axes, as an index."""

SLOW = 1e-4
"""Share of the highest desired speed so far below which a waypoint is near."""
AT_REST = 1e-9
"""Share of the highest desired speed so far that is no motion."""
FREE = "nothing turns the base"
UNAVAILABLE = {
    "attitude": f"{FREE}, so its attitude drifts and is no error",
    "base_torque": f"{FREE}, for it has no actuators",
}
"""Columns that a flight with a free base does not have, and why."""


def controls_base(log: FlightLog) -> bool:
    """Return whether the base had actuators; else it floated freely."""
    described = log.flight.get("base_actuators")
    return not (isinstance(described, dict) and described.get("base_actuation") == "none")


def axis_groups(
    n: int, controls_base: bool = True, prismatic: Sequence[bool] = (), branches: Sequence[int] = ()
) -> dict[str, AxisIndex]:
    """Divide the n+3 axes into the base and groups of joints, by their keys' suffix.

    Those of one arm are inner (1 to 3) and outer joints; where there are several ``branches`` on
    the base, each of so many joints, a branch is a group. Joints are divided by their kind instead
    if some are ``prismatic`` (of n joints at least, or empty: none is), for no number may be of rad
    and of m. The base is no group of a flight in which nothing turns it.
    """
    groups: dict[str, AxisIndex] = {"base": slice(0, 3)} if controls_base else {}
    if any(prismatic[:n]):
        for key, is_prismatic in (("revolute", False), ("prismatic", True)):
            joints = [3 + joint for joint in range(n) if prismatic[joint] == is_prismatic]
            groups |= {key: joints} if joints else {}
        return groups
    if len(branches) > 1:
        first = 1
        for count in branches:
            last = first + count - 1
            groups[f"{first}_{last}" if count > 1 else f"{first}"] = slice(first + 2, last + 3)
            first = last + 1
        return groups
    groups[f"1_{min(n, 3)}"] = slice(3, 3 + min(n, 3))
    if n > 3:
        groups[f"4_{n}"] = slice(6, 3 + n)
    return groups


def tracking_error(log: FlightLog) -> Array:
    """Compute ``e = rho_d - rho = [-eps_e, theta_d - theta]`` (N, n+3): -, then rad or m.

    ``eps_e`` is the vector part of `attitude_error`.
    """
    return joined_error(log, attitude_error(log))


def joined_error(log: FlightLog, attitude: Array) -> Array:
    """Return the `tracking_error` with ``attitude`` (N, 4) as the `attitude_error`."""
    error = np.empty((log.ticks, log.axes))
    np.subtract(0.0, attitude[:, 1:], out=error[:, :3])
    np.subtract(log.reference_joints[:, 0], log.joint_positions, out=error[:, 3:])
    return error


def attitude_error(log: FlightLog) -> Array:
    """Compute ``q_e = q_d* (x) q`` (N, 4), the rotation from the desired attitude to the true one.

    Of +-q_e it is the one with eta >= 0. Its vector part is the same on the axes of both frames.
    """
    return relative_attitude(log.reference_base, log.quaternion)


def relative_attitude(first: Array, second: Array) -> Array:
    """Compute ``first* (x) second`` (N, 4), of quaternions (N, 4) ``[w, x, y, z]``; eta >= 0.

    Of ``first`` columns after the fourth are ignored.
    """
    error = np.zeros((len(second), 4))
    _relative_attitudes(np.ascontiguousarray(first), np.ascontiguousarray(second), error)
    return error


@kernel
def _relative_attitudes(first: Array, second: Array, out: Array) -> None:
    for i in range(len(out)):
        attitude_error_into(first[i], second[i], out[i])


def attitude_angles(log: FlightLog) -> Array:
    """Compute the error of the attitude, (N, 3) deg: the rotation vector of ``q_e*``.

    Like `tracking_error` it is that of the desired attitude less the true one.
    """
    angles: Array = -np.degrees(rotation_vectors(attitude_error(log)))
    return angles


def unit_quaternions(eps: Array) -> Array:
    """Return the unit quaternions (N, 4) with the vector parts (N, 3), and eta >= 0."""
    return np.hstack([np.sqrt(np.maximum(1.0 - dot_rows(eps, eps), 0.0)), eps])


def rotation_vectors(quaternions: Array) -> Array:
    """Compute the rotation vectors (N, 3), rad, of quaternions (N, 4) with eta >= 0."""
    vectors = quaternions[:, 1:]
    sine = norms(vectors)
    angle, is_turned = 2.0 * np.arctan2(sine, quaternions[:, 0]), sine > 0.0
    rotations: Array = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=is_turned)
    return rotations[:, np.newaxis] * vectors


def attitude_drift(log: FlightLog, start: Array | None = None) -> Array:
    """(N, 3) rad, the rotation vector of the base, on its axes, from where it was to each tick.

    The arm's motion turns a base without actuators by momentum exchange, so its attitude has no
    error: this angle is measured in its place.

    ``start``: (4,) the attitude to count from (None: that of the first row).
    """
    first = log.quaternion[0] if start is None else start
    turned = relative_attitude(np.broadcast_to(first, log.quaternion.shape), log.quaternion)
    return rotation_vectors(turned)


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


def mean_acceleration(log: FlightLog, error: Array) -> Array:
    """(N-1, m) mean rhodd over the interval that begins at each tick.

    It is the change of ``rhodot = [J0(q_e) omega_e, thetadot]`` (22), with J0 of (1).
    ``error``: (N, 4) q_e, here and below.
    """
    omega, eta, eps = relative_rate(log), error[:, :1], error[:, 1:]
    epsdot = 0.5 * (eta * omega + np.cross(eps, omega))
    return np.diff(np.hstack([epsdot, log.joint_velocities]), axis=0) / log.timebase.period


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


def waypoint_ticks(log: FlightLog) -> NDArray[np.intp]:
    """Return the rows at which all desired joint velocities vanish; both ends of a longer rest.

    Where none is exactly 0 at a tick, the slowest one counts. Of an arm that never moves it is the
    first row.
    """
    speed: Array = reduce(np.maximum, (np.abs(own) for own in log.reference_joints[:, 1].T))
    highest = np.fmax.accumulate(speed)
    if not len(speed) or not highest[-1] > 0.0:
        return np.array([0])
    slow, rests = speed <= SLOW * highest, speed <= AT_REST * highest
    edges = np.flatnonzero(np.diff(slow.astype(np.int8), prepend=0, append=0))
    waypoints: list[int] = []
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        resting = begin + np.flatnonzero(rests[begin:end])
        slowest = begin + int(np.argmin(speed[begin:end]))
        waypoints += [int(resting[0]), int(resting[-1])] if len(resting) else [slowest]
    return np.unique(np.array(waypoints, dtype=np.intp))


def junction_ticks(log: FlightLog) -> NDArray[np.intp]:
    """Waypoints inside the flight, where a motion has ended and another begins."""
    ticks = waypoint_ticks(log)
    return ticks[(ticks > 0) & (ticks < log.ticks - 1)]
