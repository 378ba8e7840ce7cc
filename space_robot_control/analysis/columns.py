"""The columns of a flight for other programs: each number of a tick has a name with its unit.

Names are ``what_axis_unit``. Quaternions are ``[w, x, y, z]`` and have no unit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, laws_of

from .metrics import tracking_error

Array = NDArray[np.float64]

BATCH = 16_384
"""Ticks that are laid out at a time; this bounds the memory of an export."""
XYZ, WXYZ = "xyz", "wxyz"


def column_names(log: FlightLog) -> list[str]:
    """The names of all columns, in order; the first is ``tick``, the only one of integers."""
    return ["tick", *_names(log)]


def batches(log: FlightLog) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """The rows of `column_names`, `BATCH` ticks at a time: ticks (K,) and all other columns (K, C).

    NaN stands for a number that is not known.
    """
    error = tracking_error(log)
    for start in range(0, log.ticks, BATCH):
        rows = slice(start, min(start + BATCH, log.ticks))
        ticks = np.arange(rows.start, rows.stop) + log.first_tick
        yield ticks, np.hstack(_blocks(log, error, ticks, rows))


def metadata(log: FlightLog) -> dict[str, Any]:
    """Describe what was flown, lost and found damaged, ready for JSON."""
    return {
        "flight": log.flight,
        "laws": as_data(laws_of(log), log.timebase),
        "lost": log.lost, "unanswered_ticks": log.unanswered,
        "filled_ticks": log.filled, "unfinished": log.unfinished, "damage": list(log.damage),
        "foreign": list(log.foreign),
    }  # fmt: skip


def _names(log: FlightLog) -> list[str]:
    joints, axes = log.joint_names, [*_each("base", XYZ), *log.joint_names]
    names = [
        "time_s",
        *_each("base_position", XYZ, "m"),
        *_each("q", WXYZ),
        *_each("base_velocity", XYZ, "m_s"),
        *_each("omega_base", XYZ, "rad_s"),
        *(f"{joint}_position_rad" for joint in joints),
        *(f"{joint}_velocity_rad_s" for joint in joints),
        *_each("applied_torque", axes, "n_m"),
    ]
    if log.commanded_torque is not None:
        names += _each("commanded_torque", axes, "n_m")
    if log.latency_s is not None:
        names.append("latency_s")
    return [
        *names,
        *_each("reference_q", WXYZ),
        *_each("reference_omega_base", XYZ, "rad_s"),
        *_each("reference_omega_base_rate", XYZ, "rad_s2"),
        *(f"reference_{joint}_position_rad" for joint in joints),
        *(f"reference_{joint}_velocity_rad_s" for joint in joints),
        *(f"reference_{joint}_acceleration_rad_s2" for joint in joints),
        *_each("error_q", XYZ),
        *_each("error", joints, "rad"),
    ]


def _blocks(log: FlightLog, error: Array, ticks: NDArray[np.int64], rows: slice) -> list[Array]:
    """Arrays (rows, columns) in the order of `_names`."""
    count = len(ticks)
    blocks = [
        (ticks * log.timebase.period_ns / 1e9)[:, np.newaxis],
        log.base_position[rows], log.quaternion[rows], log.base_velocity[rows],
        log.omega_base[rows], log.joint_positions[rows], log.joint_velocities[rows],
        log.applied_torque[rows],
    ]  # fmt: skip
    if log.commanded_torque is not None:
        blocks.append(log.commanded_torque[rows])
    if log.latency_s is not None:
        blocks.append(log.latency_s[rows, np.newaxis])
    joints = log.reference_joints[rows].reshape(count, -1)
    return [*blocks, log.reference_base[rows], joints, error[rows]]


def _each(what: str, axes: Sequence[str], unit: str = "") -> list[str]:
    return ["_".join(filter(None, (what, axis, unit))) for axis in axes]
