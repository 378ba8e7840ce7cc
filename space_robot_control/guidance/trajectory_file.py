"""Trajectories from CSV and Parquet files.

Columns are ``time`` (s, rising), every joint with a motor by its name (rad, or m of prismatic
joints), and, if the base turns, its quaternion ``q_w, q_x, q_y, q_z``. Columns ``<joint>_rate``
(rad/s or m/s) are optional: they must belong to the positions. Other columns are not read.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.spline import CubicSpline
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.config.yaml_text import YamlTextError, check_file, parse_yaml
from space_robot_msgs_py.errors import InputError

from .courses import AttitudeCourse, Course, Slew, SplineCourse

Array = NDArray[np.float64]
Columns = Mapping[str, Sequence[float]]

TIME, RATE = "time", "_rate"
QUATERNION = ("q_w", "q_x", "q_y", "q_z")
MOST_ROWS = 100_000
SAME_PLACE = 1e-6
"""rad or m, that the first row may be away from where the segment begins."""
SAME_RATE = 0.02
"""Share of a joint's largest rate that a given rate may differ from that of the positions."""


def with_columns(text: str, folder: Path) -> str:
    """Return the text of a segment with the columns of its file in place of the file's name.

    Args:
        text: of the segment, YAML.
        folder: where a relative path begins.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        content = parse_yaml(text)
    except YamlTextError:
        return text  # refused where segments are read
    if not isinstance(content, dict) or not isinstance(name := content.get("file"), str):
        return text
    rest = {key: value for key, value in content.items() if key != "file"}
    return json.dumps({"trajectory": read_columns(folder / name), **rest})


def read_columns(path: Path) -> dict[str, list[float]]:
    """Read the columns of a CSV or Parquet file.

    Raises:
        InputError: it cannot be read, or holds something that is no number; names line and column.
    """
    check_file(path)
    if path.suffix == ".parquet":
        try:
            from pyarrow import parquet
        except ImportError:
            raise InputError(f"{path}: Parquet files need pyarrow: [parquet]") from None
        table = parquet.read_table(path)
        return {name: table.column(name).to_pylist() for name in table.column_names}
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    if not rows:
        raise InputError(f"{path}: the file is empty")
    names, *body = [[cell.strip() for cell in row] for row in rows if row]
    columns: dict[str, list[float]] = {name: [] for name in names}
    for number, row in enumerate(body, 2):
        if len(row) != len(names):
            raise InputError(f"{path}: line {number}: {len(names)} cells expected, got {len(row)}")
        for name, cell in zip(names, row, strict=True):
            columns[name].append(_number(cell, f"{path}: line {number}: {name}"))
    return columns


def _number(cell: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: a number was expected, got {short(cell)}")
    return value


class TrajectoryTable:
    """A trajectory of joints and base, by cubic splines through its rows."""

    def __init__(self, columns: Columns, joint_names: Sequence[str]) -> None:
        """Check the columns and make the splines.

        Raises:
            InputError: a column is missing, times do not rise, or rates do not belong to positions.
        """
        missing = [name for name in (TIME, *joint_names) if name not in columns]
        if missing:
            raise InputError(
                f"trajectory: column {short(missing[0])} is missing; there are {', '.join(columns)}"
            )
        time = np.array(columns[TIME], dtype=np.float64)
        if not 2 <= len(time) <= MOST_ROWS:
            raise InputError(f"trajectory: 2 to {MOST_ROWS} rows were expected, got {len(time)}")
        if np.any(np.diff(time) <= 0.0):
            row = int(np.argmax(np.diff(time) <= 0.0)) + 1
            raise InputError(
                f"trajectory: time must rise, got {time[row]:g} s after {time[row - 1]:g} s"
            )
        self._time = time - time[0]
        self.duration = float(self._time[-1])
        """s."""
        positions = np.column_stack([np.array(columns[name], float) for name in joint_names])
        rates = [columns.get(f"{name}{RATE}") for name in joint_names]
        ends = np.array([[r[0], r[-1]] if r is not None else [0.0, 0.0] for r in rates]).T
        self._joints = CubicSpline(self._time, positions, ends[0], ends[1])
        for joint, (name, rate) in enumerate(zip(joint_names, rates, strict=True)):
            if rate is not None:
                _check_rates(name, np.array(rate), self._joints.rates[:, joint], time)
        self._attitude: CubicSpline | None = None
        columns_of_base = [name for name in QUATERNION if name in columns]
        if columns_of_base and len(columns_of_base) < 4:
            raise InputError(
                f"trajectory: {', '.join(columns_of_base)} without the rest of a quaternion"
            )
        if columns_of_base:
            self._attitude = CubicSpline(self._time, _quaternions(columns))

    def courses(self, begin: float, joints: Array, quaternion: Array) -> tuple[Course, Course]:
        """Return the courses of joints and base from a time, posture and attitude on.

        Raises:
            InputError: the trajectory begins elsewhere.
        """
        away = np.abs(self._joints.values[0] - joints)
        if away.max() > SAME_PLACE:
            joint = int(np.argmax(away))
            raise InputError(
                f"trajectory: joint {joint + 1} begins at {self._joints.values[0, joint]:.6g}, the "
                f"mission is at {joints[joint]:.6g} then (rad or m)"
            )
        course = SplineCourse(begin, self._joints)
        if self._attitude is None:
            return course, Slew(begin, self.duration, quaternion, np.zeros(3), 0.0)
        first = self._attitude.values[0]
        if min(np.abs(first - quaternion).max(), np.abs(first + quaternion).max()) > SAME_PLACE:
            raise InputError("trajectory: the base begins with another attitude than the mission's")
        return course, AttitudeCourse(begin, self._attitude)


def _quaternions(columns: Columns) -> Array:
    """Return unit quaternions (K, 4), each in the hemisphere of the one before."""
    rows = np.column_stack([np.array(columns[name], float) for name in QUATERNION])
    lengths = np.sqrt(sum(rows[:, k] * rows[:, k] for k in range(4)))
    if np.any(np.abs(lengths - 1.0) > 1e-3):
        raise InputError("trajectory: quaternions must have norm 1")
    rows /= lengths[:, np.newaxis]
    products = sum(rows[1:, k] * rows[:-1, k] for k in range(4))
    rows[1:] *= np.cumprod(np.where(products < 0.0, -1.0, 1.0))[:, np.newaxis]
    return rows


def _check_rates(name: str, rates: Array, of_positions: Array, time: Array) -> None:
    allowed = SAME_RATE * float(np.max(np.abs(of_positions))) + 1e-9
    difference = np.abs(rates - of_positions)
    if difference.max() > allowed:
        row = int(np.argmax(difference))
        raise InputError(
            f"trajectory: {name}{RATE} is {rates[row]:.6g} at {time[row]:g} s, the positions of "
            f"{name} change at {of_positions[row]:.6g}"
        )
