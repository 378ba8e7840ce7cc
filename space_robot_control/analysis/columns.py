"""A flight as a table for other programs: a named column with its unit for every number of a tick.

Names are ``what_axis_unit``. Quaternions are ``[w, x, y, z]`` and have no unit.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, laws_of

from .metrics import tracking_error

Array = NDArray[np.float64]

BATCH = 65_536
"""Ticks that are laid out as a table at a time: what bounds the memory of an export."""
METADATA_KEY = b"space_robot"
"""Of a Parquet file's schema: what was flown and what was lost, as JSON."""
XYZ, WXYZ = "xyz", "wxyz"


def schema(log: FlightLog) -> pa.Schema:
    """Names and types of the columns; its metadata is the flight's description."""
    about = {
        "flight": log.flight,
        "laws": as_data(laws_of(log), log.timebase),
        "lost": log.lost, "unanswered_ticks": log.unanswered,
        "filled_ticks": log.filled, "unfinished": log.unfinished, "damage": list(log.damage),
        "foreign": list(log.foreign),
    }  # fmt: skip
    fields = [pa.field("tick", pa.int64(), nullable=False)]
    fields += [pa.field(name, pa.float64()) for name in _names(log)]
    return pa.schema(fields, metadata={METADATA_KEY: json.dumps(about).encode()})


def batches(log: FlightLog) -> Iterator[pa.RecordBatch]:
    """The rows of `schema`, `BATCH` ticks at a time; NaN becomes null."""
    layout = schema(log)
    error = tracking_error(log)
    for start in range(0, log.ticks, BATCH):
        rows = slice(start, min(start + BATCH, log.ticks))
        ticks = np.arange(rows.start, rows.stop) + log.first_tick
        arrays = [pa.array(ticks)]
        arrays += [
            pa.array(np.ascontiguousarray(column), from_pandas=True)
            for block in _blocks(log, error, ticks, rows)
            for column in block.T
        ]
        yield pa.record_batch(arrays, schema=layout)


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
    """(rows, columns) arrays in the order of `_names`."""
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
