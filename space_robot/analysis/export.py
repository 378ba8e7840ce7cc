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

Array = NDArray[np.float64]

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
    """Return the columns, a row a tick; NaN is a number that is not known.

    Raises:
        InputError: pandas is not installed.
    """
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
    """Check that Parquet files can be written, before any work is done for them.

    Raises:
        InputError: pyarrow is not installed.
    """
    if find_spec("pyarrow") is None:
        raise InputError(f"Parquet files need pyarrow: {install_command('parquet')}")


def write_csv(log: FlightLog, path: Path) -> None:
    """Write the columns as text; a number that is not known is empty.

    Raises:
        InputError: the file exists or cannot be written.
    """
    with csv_writer(path) as writer:
        writer.writerow(column_names(log))
        for ticks, numbers in batches(log):
            writer.writerows(csv_rows(ticks, numbers))


def write_parquet(log: FlightLog, path: Path) -> None:
    """Write the columns; the schema's metadata describes the flight.

    Raises:
        InputError: the file exists or cannot be written, or pyarrow is not installed.
    """
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
    joints, lengths = log.joint_names, log.prismatic
    torques = [*["n_m"] * 3, *("n" if slides else "n_m" for slides in lengths[: len(joints)])]
    axes = [*_each("base", XYZ), *joints]
    error, q_d, joints_d = tracking_error(log), log.reference_base, log.reference_joints
    yield ["time_s"], (_ticks(log) * log.timebase.period_ns / 1e9)[:, np.newaxis]
    yield _each("base_position", XYZ, "m"), log.base_position
    yield _each("q", WXYZ), log.quaternion
    yield _each("base_velocity", XYZ, "m_s"), log.base_velocity
    yield _each("omega_base", XYZ, "rad_s"), log.omega_base
    for names, slides, positions, velocities in (
        (joints, lengths, log.joint_positions, log.joint_velocities),
        (log.passive_names, lengths[len(joints) :], log.passive_positions, log.passive_velocities),
    ):
        yield _joint_columns("{}_position", names, slides), positions
        yield _joint_columns("{}_velocity", names, slides, "_s"), velocities
    yield _with_units("applied_torque", axes, torques), log.applied_torque
    if (measured := log.measured) is not None:
        yield _each("measured_q", WXYZ), measured.quaternion
        yield _each("measured_omega_base", XYZ, "rad_s"), measured.omega_base
        yield _joint_columns("measured_position_{}", joints, lengths), measured.joint_positions
        yield (
            _joint_columns("measured_velocity_{}", joints, lengths, "_s"),
            measured.joint_velocities,
        )
        yield _with_units("reported_torque", axes, torques), measured.applied_torque
    if log.assumed_error is not None:
        yield _each("assumed_error_q", XYZ), log.assumed_error[:, :3]
        yield _joint_columns("assumed_error_{}", joints, lengths), log.assumed_error[:, 3:]
    if log.commanded_torque is not None:
        yield _with_units("commanded_torque", axes, torques), log.commanded_torque
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
    for k, (number, per) in enumerate(
        (("position", ""), ("velocity", "_s"), ("acceleration", "_s2"))
    ):
        yield _joint_columns(f"reference_{{}}_{number}", joints, lengths, per), joints_d[:, k]
    if controls_base(log):
        yield _each("error_q", XYZ), error[:, :3]
        yield _each("error_base", XYZ, "deg"), attitude_angles(log)
    yield _joint_columns("error_{}", joints, lengths), error[:, 3:]
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


def _joint_columns(
    what: str, joints: Sequence[str], slides: Sequence[bool], per: str = ""
) -> list[str]:
    """Return a name a joint, with its unit: rad, or m of one that slides, ``per`` a time."""
    units = ("m" if is_prismatic else "rad" for is_prismatic in slides)
    return [f"{what.format(joint)}_{unit}{per}" for joint, unit in zip(joints, units, strict=False)]


def _with_units(what: str, axes: Sequence[str], units: Sequence[str]) -> list[str]:
    return [f"{what}_{axis}_{unit}" for axis, unit in zip(axes, units, strict=True)]


def _numbered(what: str, count: int, unit: str) -> list[str]:
    return _each(what, [str(k + 1) for k in range(count)], unit)


def _each(what: str, axes: Sequence[str], unit: str = "") -> list[str]:
    return ["_".join(filter(None, (what, axis, unit))) for axis in axes]
