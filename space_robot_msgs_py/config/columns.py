"""Columns of numbers in CSV and Parquet files."""

from __future__ import annotations

import csv
import math
from pathlib import Path

from ..errors import InputError
from .validation import short
from .yaml_text import check_file


def read_columns(path: Path) -> dict[str, list[float]]:
    """Read the columns of a CSV or Parquet file.

    Raises:
        InputError: it cannot be read, or holds something that is no number; names line and column.
    """
    check_file(path)
    if path.suffix == ".parquet":
        return _read_parquet(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a CSV file ({error})") from None
    if not rows:
        raise InputError(f"{path}: the file is empty")
    names, *body = [[cell.strip() for cell in row] for row in rows if row]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"{path}: two columns are called {short(twice[0])}")
    columns: dict[str, list[float]] = {name: [] for name in names}
    for number, row in enumerate(body, 2):
        if len(row) != len(names):
            raise InputError(f"{path}: line {number}: {len(names)} cells expected, got {len(row)}")
        for name, cell in zip(names, row, strict=True):
            columns[name].append(_number(cell, f"{path}: line {number}: {name}"))
    return columns


def _read_parquet(path: Path) -> dict[str, list[float]]:
    try:
        from pyarrow import ArrowInvalid, parquet
    except ImportError:
        raise InputError(f"{path}: Parquet files need pyarrow: [parquet]") from None
    try:
        table = parquet.read_table(path)
    except ArrowInvalid as error:
        raise InputError(f"{path}: not a Parquet file ({error})") from None
    return {name: table.column(name).to_pylist() for name in table.column_names}


def _number(cell: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: a number was expected, got {short(cell)}")
    return value
