"""A flight as a table of pandas; as a CSV or Parquet file, whole or not at all, over no other.

Columns are named ``what_axis_unit``. Quaternions are ``[w, x, y, z]`` and have no unit.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, laws_of
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import PASSIVE_FIELDS, STATE_FIELDS, StateSignals
from space_robot_msgs_py.signals import Each, Signal, signals_of

from ..console.files import atomic_file, csv_rows, csv_writer
from .errors import attitude_angles, controls_base, tracking_error
from .report import recording

if TYPE_CHECKING:
    from pandas import DataFrame

BATCH = 16_384
"""Ticks that are laid out at a time; this bounds the memory of an export."""
XYZ, WXYZ = "xyz", "wxyz"
NAMED_ABOVE = (*STATE_FIELDS, *PASSIVE_FIELDS, "wheel_velocities", "wheel_torques", "thrusts")
"""Signals with names of their own; those of others follow from their declaration."""
JOINT_NAMES = {"joints": "joint_names", "passive": "passive_names", "geared": "geared_names"}
"""Attribute of a log with the names of what has a number each."""
METADATA_KEY = b"space_robot"
"""The key of the flight's description, as JSON, in the metadata of a Parquet file's schema."""


def dataframe(log: FlightLog) -> DataFrame:
    """Return the columns, a row a tick; NaN is a number that is not known."""
    try:
        import pandas as pd
    except ImportError:
        raise InputError(f"tables need pandas: {install_command('campaign')}") from None
    tick, *others = column_names(log)
    parts = list(batches(log))
    table = pd.DataFrame(np.vstack([numbers for _, numbers in parts]), columns=others)
    table.insert(0, tick, np.concatenate([ticks for ticks, _ in parts]))
    return table


def check_parquet() -> None:
    """Check that Parquet files can be written, before any work is done for them."""
    if find_spec("pyarrow") is None:
        raise InputError(f"Parquet files need pyarrow: {install_command('parquet')}")


def write_csv(log: FlightLog, path: Path) -> None:
    """Write the columns as text; a number that is not known is empty."""
    with csv_writer(path) as writer:
        writer.writerow(column_names(log))
        for ticks, numbers in batches(log):
            writer.writerows(csv_rows(ticks, numbers))


def write_parquet(log: FlightLog, path: Path) -> None:
    """Write the columns; the schema's metadata describes the flight."""
    check_parquet()
    import pyarrow as pa
    from pyarrow import parquet

    tick, *others = column_names(log)
    schema = pa.schema(
        [pa.field(tick, pa.int64(), nullable=False), *((name, pa.float64()) for name in others)],
        metadata={METADATA_KEY: json.dumps(metadata(log)).encode()},
    )
    with (
        atomic_file(path) as file,
        parquet.ParquetWriter(file, schema, compression="zstd", use_dictionary=False) as writer,
    ):
        for ticks, numbers in batches(log):
            columns = [pa.array(np.ascontiguousarray(c), from_pandas=True) for c in numbers.T]
            writer.write_batch(pa.record_batch([pa.array(ticks), *columns], schema=schema))


def column_names(log: FlightLog) -> list[str]:
    """Return the columns' names in order; the first is ``tick``, the only one of integers."""
    return ["tick", *(name for names, _ in _columns(log.rows(0, 0)) for name in names)]


def batches(log: FlightLog) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """Yield the rows, `BATCH` ticks at a time: ticks (K,) and all other columns (K, C).

    NaN stands for a number that is not known.
    """
    for start in range(0, log.ticks, BATCH):
        rows = log.rows(start, min(start + BATCH, log.ticks))
        yield _ticks(rows), np.hstack([values for _, values in _columns(rows)])


def metadata(log: FlightLog) -> dict[str, Any]:
    """Describe the flight, lost messages and damage, ready for JSON."""
    return {"flight": log.flight, "laws": as_data(laws_of(log), log.timebase), **recording(log)}


def _ticks(log: FlightLog) -> NDArray[np.int64]:
    return np.arange(log.ticks) + log.first_tick


def _columns(log: FlightLog) -> Iterator[tuple[list[str], Array]]:
    """Yield names and values (N, K) of columns that belong together."""
    sliding = log.flight.get("prismatic_joints", ())
    joints, axes = log.joint_names, [*_each("base", XYZ), *log.joint_names]

    def each_joint(what: str, names: Sequence[str], per: str = "") -> list[str]:
        units = ["m" if name in sliding else "rad" for name in names]
        return [f"{what.format(n)}_{unit}{per}" for n, unit in zip(names, units, strict=True)]

    def each_torque(what: str) -> list[str]:
        return [f"{what}_{axis}_{'n' if axis in sliding else 'n_m'}" for axis in axes]

    error, q_d, joints_d = tracking_error(log), log.reference_base, log.reference_joints
    yield ["time_s"], (_ticks(log) * log.timebase.period_ns / 1e9)[:, np.newaxis]
    yield _each("base_position", XYZ, "m"), log.base_position
    yield _each("q", WXYZ), log.quaternion
    yield _each("base_velocity", XYZ, "m_s"), log.base_velocity
    yield _each("omega_base", XYZ, "rad_s"), log.omega_base
    yield each_joint("{}_position", joints), log.joint_positions
    yield each_joint("{}_velocity", joints, "_s"), log.joint_velocities
    yield each_joint("{}_position", log.passive_names), log.passive_positions
    yield each_joint("{}_velocity", log.passive_names, "_s"), log.passive_velocities
    yield each_torque("applied_torque"), log.applied_torque
    if (measured := log.measured) is not None:
        yield _each("measured_q", WXYZ), measured.quaternion
        yield _each("measured_omega_base", XYZ, "rad_s"), measured.omega_base
        yield each_joint("measured_position_{}", joints), measured.joint_positions
        yield each_joint("measured_velocity_{}", joints, "_s"), measured.joint_velocities
        yield each_torque("reported_torque"), measured.applied_torque
    if log.assumed_error is not None:
        yield _each("assumed_error_q", XYZ), log.assumed_error[:, :3]
        yield each_joint("assumed_error_{}", joints), log.assumed_error[:, 3:]
    if log.commanded_torque is not None:
        yield each_torque("commanded_torque"), log.commanded_torque
    wheels, thrusters = log.wheel_velocities.shape[1], log.thrusts.shape[1]
    torquers = max(0, log.actuator_commands.shape[1] - wheels - thrusters)
    yield _numbered("wheel_velocity", wheels, "rad_s"), log.wheel_velocities
    yield _numbered("wheel_torque", wheels, "n_m"), log.wheel_torques
    yield _numbered("thrust", thrusters, "n"), log.thrusts
    commanded = [
        *_numbered("commanded_wheel_torque", wheels, "n_m"),
        *_numbered("commanded_thrust", thrusters, "n"),
        *_numbered("commanded_dipole", torquers, "a_m2"),
    ]
    if len(commanded) == log.actuator_commands.shape[1]:
        yield commanded, log.actuator_commands
    if log.latency_s is not None:
        yield ["latency_s"], log.latency_s[:, np.newaxis]
    yield _each("reference_q", WXYZ), q_d[:, :4]
    yield _each("reference_omega_base", XYZ, "rad_s"), q_d[:, 4:7]
    yield _each("reference_omega_base_rate", XYZ, "rad_s2"), q_d[:, 7:]
    yield each_joint("reference_{}_position", joints), joints_d[:, 0]
    yield each_joint("reference_{}_velocity", joints, "_s"), joints_d[:, 1]
    yield each_joint("reference_{}_acceleration", joints, "_s2"), joints_d[:, 2]
    if controls_base(log):
        yield _each("error_q", XYZ), error[:, :3]
        yield _each("error_base", XYZ, "deg"), attitude_angles(log)
    yield each_joint("error_{}", joints), error[:, 3:]
    for name, declared in signals_of(StateSignals).items():
        values = getattr(log, name)
        if name not in NAMED_ABOVE and values.shape[1]:
            unit = re.sub(r"\W", "_", declared.unit).lower()
            yield _further(name, declared, log, unit), values


def _further(name: str, declared: Signal, log: FlightLog, unit: str) -> list[str]:
    """Return names of the columns of a signal that only some robots have."""
    if isinstance(declared.size, Each):
        return _each(name, getattr(log, JOINT_NAMES[declared.size.names]), unit)
    if declared.size in (1, 3):
        return _each(name, XYZ if declared.size == 3 else [""], unit)
    return _each("", declared.labels, unit)


def _numbered(what: str, count: int, unit: str) -> list[str]:
    return _each(what, [str(k + 1) for k in range(count)], unit)


def _each(what: str, axes: Sequence[str], unit: str = "") -> list[str]:
    return ["_".join(filter(None, (what, axis, unit))) for axis in axes]
