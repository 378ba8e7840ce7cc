"""Tracking errors and pointing, of the base and of the end effector.

The base's error is the rotation from its desired attitude, as in a pointing budget
(ECSS-E-ST-60-10C): the absolute performance error (APE) is the error at a tick, the relative one
(RPE, here "jitter") its difference from its mean over a window.

The tool's pose follows from base attitude and joint angles (`placements.tool_pose`), once with the
measured ones and once with the desired ones. The base's position is free in this mission
("semi-floating"), so both poses share it and its drift is given separately.
"""

from __future__ import annotations

import numpy as np

from space_robot_model.elementary.matrices import Array, dot_rows, norms, unit_rows
from space_robot_model.robot.placements import tool_pose
from space_robot_msgs_py.bag.flight_log import BLOCK_TICKS

from .analysed_log import ANGLES, AnalysedLog, window_ticks
from .errors import (
    attitude_drift,
    joined_error,
    relative_attitude,
    rotation_vectors,
    unit_quaternions,
)
from .series import Definition, TimeSeries, metrics, series

ARCSEC = np.pi / 180.0 / 3600.0
"""rad."""
TABLE_V = ("rms", "rms_eq64", "max")
ALL = ("rms", "max", "end")


@series(
    "errors",
    {
        "attitude_angle": Definition(
            "deg", "error of the base's attitude, as rotation vector", TABLE_V, True
        ),
        "attitude": Definition(
            "-",
            "error of the base's attitude, vector part of the quaternion (half the angle, rad)",
            TABLE_V,
            is_vector=True,
            is_shown=False,
        ),
        "joints_prismatic": Definition("m", "desired less true position of these joints", TABLE_V),
        "joints_*": Definition("rad", "desired less true angle of these joints", TABLE_V),
        "half_cone": Definition(
            "arcsec",
            "angle between the true and the desired direction of the axis that points",
            ALL,
        ),
        "about_axis": Definition("arcsec", "rotation of the base about the axis that points", ALL),
        "base_rotation": Definition("arcsec", "rotation between desired and true attitude", ALL),
    },
)
def errors(flight: AnalysedLog) -> TimeSeries:
    """Return the errors of base and joints, and the angles of the base's pointing."""
    log, m, is_held = flight.log, flight.log.axes, flight.controls_base
    axes = dict(flight.error_columns)
    if is_held:
        angle = {"attitude_angle": slice(m, m + 3)}
        axes = {**angle, **axes, **{name: [m + 3 + k] for k, name in enumerate(ANGLES)}}

    def values(start: int, stop: int) -> Array:
        attitude = flight.attitude_errors(start, stop)
        error = joined_error(log.rows(start, stop), attitude)
        if not is_held:
            return error
        vectors = rotation_vectors(attitude)
        return np.hstack([error, np.degrees(vectors), base_angles(attitude, vectors, flight)])

    return TimeSeries(axes, values)


def base_angles(attitude: Array, vectors: Array, flight: AnalysedLog) -> Array:
    """Return the angles (N, 3) of the base's pointing, arcsec, by `ANGLES`.

    ``attitude``: (N, 4) `attitude_error`; ``vectors``: (N, 3) rad, the same as rotation vectors.
    """
    axis, eps = np.array(flight.budget.axis), attitude[:, 1:]
    about = dot_rows(eps, axis[np.newaxis])
    across, rest = eps - about * axis, np.hstack([attitude[:, :1], about])
    half_cone = 2.0 * np.arctan2(norms(across), norms(rest))
    turned = 2.0 * np.arctan2(np.abs(about[:, 0]), attitude[:, 0])
    angles: Array = np.stack([half_cone, turned, norms(vectors)], axis=1) / ARCSEC
    return angles


@metrics(
    "errors",
    {
        "{angle}.within_band": Definition("share", "share of time within the band (--band)"),
        "{angle}.outside_band": Definition("share", "share of time outside of it", is_shown=False),
        "{angle}.jitter_rms": Definition(
            "arcsec", "RMS of the difference from the mean in a window (--window)"
        ),
        "{angle}.jitter_max": Definition("arcsec", "largest such difference"),
    },
    applies=lambda flight: flight.controls_base,
)
def steadiness(flight: AnalysedLog) -> dict[str, float]:
    """Compute time within the band, and jitter; a window that the flight does not fill is none."""
    axis, band = np.array(flight.budget.axis), 3600.0 * flight.budget.band_deg
    ticks = window_ticks(flight.budget.window_s, flight.log.timebase.period)
    whole = flight.log.ticks // ticks * ticks
    step = max(1, BLOCK_TICKS // ticks) * ticks
    within, squares, largest = np.zeros(3), np.zeros(3), np.zeros(3)
    for start in range(0, flight.log.ticks, step):
        attitude = flight.attitude_errors(start, min(start + step, flight.log.ticks))
        vectors = rotation_vectors(attitude)
        within += np.sum(base_angles(attitude, vectors, flight) <= band, axis=0)
        windows = vectors[: max(whole - start, 0)].reshape(-1, ticks, 3)
        away = (windows - windows.mean(axis=1, keepdims=True)).reshape(-1, 3)
        about = dot_rows(away, axis[np.newaxis])
        sizes = [norms(away - about * axis), np.abs(about[:, 0]), norms(away)]
        angles = np.stack(sizes, axis=1) / ARCSEC
        squares += np.einsum("ij,ij->j", angles, angles)
        largest = np.maximum(largest, angles.max(axis=0, initial=0.0))
    numbers: dict[str, float] = {}
    for k, name in enumerate(ANGLES):
        share = float(within[k]) / flight.log.ticks
        numbers |= {f"{name}.within_band": share, f"{name}.outside_band": 1.0 - share}
        if whole:
            numbers[f"{name}.jitter_rms"] = float(np.sqrt(squares[k] / whole))
            numbers[f"{name}.jitter_max"] = float(largest[k])
    return numbers


def lacking_for_jitter(name: str, seconds: float, window_s: float, period: float) -> str:
    """Return why there is no jitter of some seconds of a flight; empty: there is."""
    if ".jitter_" not in name or round(seconds / period) >= window_ticks(window_s, period):
        return ""
    return f"needs {window_s:g} s of flight (pointing.window_s), got {seconds:g} s"


DRIFT = "rotation of a base without actuators since the first tick"


@series("attitude drift", {"attitude_drift": Definition("rad", DRIFT, ALL)})
def drift(flight: AnalysedLog) -> TimeSeries | None:
    """Return the angle by which a free base has turned since the first tick."""
    if flight.controls_base:
        return None
    log = flight.log

    def values(start: int, stop: int) -> Array:
        return norms(attitude_drift(log.rows(start, stop), log.quaternion[0]))[:, np.newaxis]

    return TimeSeries({"attitude_drift": [0]}, values)


NAVIGATION = "true less assumed"


@series(
    "navigation error",
    {
        "navigation_attitude_angle": Definition("deg", f"{NAVIGATION} attitude", is_vector=True),
        "navigation_attitude": Definition(
            "-",
            f"{NAVIGATION} attitude, vector part of the quaternion",
            is_vector=True,
            is_shown=False,
        ),
        "navigation_joints_prismatic": Definition("m", f"{NAVIGATION} position of these joints"),
        "navigation_joints_*": Definition("rad", f"{NAVIGATION} angle of these joints"),
    },
)
def navigation(flight: AnalysedLog) -> TimeSeries | None:
    """Return how far the state that the law assumed was from the true one.

    The law tells the error e that it sees in its telemetry. Less the true one this is the true
    state less the assumed one, in the coordinates rho = [eps_e, theta], whatever stands between
    sensors and law: ``e - e_true = rho - rho_assumed``. It is known at the ticks of the telemetry.
    """
    log, m = flight.log, flight.log.axes
    if log.measured is None:
        return None
    axes = {f"navigation_{name}": index for name, index in flight.error_columns.items()}
    if flight.controls_base:
        axes = {"navigation_attitude_angle": slice(m, m + 3), **axes}

    def values(start: int, stop: int) -> Array:
        error = joined_error(log.rows(start, stop), flight.attitude_errors(start, stop))
        known = log.assumed_error
        seen = np.full_like(error, np.nan) if known is None else known[start:stop]
        turned = np.full((stop - start, 3), np.nan)
        if (rows := np.isfinite(seen).all(axis=1)).any():
            assumed, true = (unit_quaternions(-e[rows, :3]) for e in (seen, error))
            turned[rows] = np.degrees(rotation_vectors(relative_attitude(assumed, true)))
        return np.hstack([seen - error, turned])

    return TimeSeries(axes, values, "no telemetry was recorded")


POSE_ERROR = "of the end effector, true less desired"


@series(
    "end effector",
    {
        "boresight": Definition("arcsec", f"direction of the z axis {POSE_ERROR}", ALL),
        "tool_attitude": Definition("arcsec", f"rotation {POSE_ERROR}", ALL),
        "tool_position": Definition(
            "m", f"position {POSE_ERROR}, the base at its true position in both", ALL
        ),
        "base_drift": Definition(
            "m", "of the base's centre of mass from where it began; nothing holds it", ALL
        ),
    },
)
def end_effector(flight: AnalysedLog) -> TimeSeries:
    """Return the error of the tool's pose; joints without motors are to rest on their springs."""
    log, robot = flight.log, flight.robot
    rest = np.array([[spring.rest for spring in robot.springs]])

    def values(start: int, stop: int) -> Array:
        rows = log.rows(start, stop)
        actual, place = tool_pose(robot, unit_rows(rows.quaternion), rows.all_positions)
        passive = np.broadcast_to(rest, rows.passive_positions.shape)
        joints = np.hstack([rows.reference_joints[:, 0], passive])
        desired, wanted = tool_pose(robot, unit_rows(rows.reference_base[:, :4]), joints)
        return np.column_stack(
            [
                angle_between(actual[:, :, 2], desired[:, :, 2]) / ARCSEC,
                rotation_angle(actual, desired) / ARCSEC,
                norms(place - wanted),
                norms(rows.base_position - log.base_position[0]),
            ]
        )

    names = ("boresight", "tool_attitude", "tool_position", "base_drift")
    return TimeSeries({name: [k] for k, name in enumerate(names)}, values)


def angle_between(first: Array, second: Array) -> Array:
    """(N,) rad between unit vectors (N, 3), as exact for small angles as for large ones."""
    across = np.linalg.norm(np.cross(first, second), axis=1)
    angle: Array = np.arctan2(across, np.sum(first * second, axis=1))
    return angle


def rotation_angle(first: Array, second: Array) -> Array:
    """(N,) rad of the rotation ``first second^T`` (N, 3, 3), exact for small angles.

    ``sin = |vee(R - R^T)| / 2``, ``cos = (trace(R) - 1) / 2``.
    """
    # vee(a b^T - b a^T) = b x a for each pair of columns; trace(R) is the sum of their products
    crossed = np.cross(second, first, axisa=1, axisb=1).sum(axis=1)
    sine = 0.5 * np.linalg.norm(crossed, axis=1)
    cosine = 0.5 * (np.sum(first * second, axis=(1, 2)) - 1.0)
    angle: Array = np.arctan2(sine, cosine)
    return angle
