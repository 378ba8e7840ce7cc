"""Trajectories from CSV and Parquet files.

Columns are ``time`` (s, rising), every joint with a motor by its name (rad, or m of prismatic
joints), and, if the base turns, its quaternion ``q_w, q_x, q_y, q_z``. Columns ``<joint>_rate``
(rad/s or m/s) are optional: they must belong to the positions. Other columns are not read.
"""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.config.yaml_text import YamlTextError, check_file, parse_yaml
from space_robot_msgs_py.errors import InputError


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
