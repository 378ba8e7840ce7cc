"""Columns of numbers in CSV and Parquet files."""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Sequence
from itertools import islice
from pathlib import Path

from ..errors import InputError
from .text import nearest, printable
from .validation import short
from .yaml_text import check_readable

MOST_ROWS, MOST_COLUMNS, MOST_VALUES = 100_000, 1_000, 190_000
LARGEST_CSV = 128 * 2**20
"""Largest size of a CSV file, bytes."""
MOST_LISTED = 20
"""Maximum number of columns listed by an error."""
SEMICOLON = ";"
"""Separates columns where numbers have decimal commas, as spreadsheets write in many countries."""


def read_columns(path: Path) -> dict[str, list[float]]:
    """Read the columns of a CSV or Parquet file: a row with their names, then numbers.

    Columns of a CSV file are separated by commas, or by semicolons: numbers may then have decimal
    commas.

    Raises:
        InputError: it cannot be read, is too large, or holds something that is no number; names
            line and column.
    """
    check_readable(path)
    if path.suffix == ".parquet":
        return _read_parquet(path)
    if path.stat().st_size > LARGEST_CSV:
        raise InputError(f"{path}: more than {LARGEST_CSV >> 20} MiB")
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            first = file.readline()
            file.seek(0)
            has_semicolons = SEMICOLON in first and "," not in first
            rows = csv.reader(file, delimiter=SEMICOLON if has_semicolons else ",")
            filled = [(rows.line_num, row) for row in islice(rows, MOST_ROWS + 2) if row]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a CSV file ({error})") from None
    if not filled:
        raise InputError(f"{path}: the file is empty")
    (_, header), *body = filled
    names = [cell.strip() for cell in header]
    _check_names(names, path)
    _check_size(len(body), len(names), path)
    columns: dict[str, list[float]] = {name: [] for name in names}
    for line, row in body:
        where = f"{path}: line {line}"
        if len(row) != len(names):
            empty = "; the last one is empty: a comma at the end?" if not row[-1].strip() else ""
            raise InputError(
                f"{where}: {len(names)} cells expected, got {len(row)} ({listed(names)}{empty})"
            )
        for name, cell in zip(names, row, strict=True):
            columns[name].append(_number(cell, f"{where}: {printable(name)}", has_semicolons))
    return columns


def missing_column(name: str, columns: Collection[str]) -> str:
    """Return the end of an error about a column that is missing."""
    near = " or ".join(printable(other) for other in nearest(name, list(columns)))
    return f"column {name} is missing; there are {listed(columns)}" + (
        f" (did you mean {near}?)" if near else ""
    )


def listed(names: Collection[str]) -> str:
    """Return the names of columns for an error, the first ones of many."""
    shown = ", ".join(short(name)[1:-1] for name in islice(names, MOST_LISTED))
    return f"{shown}, ... ({len(names)} in all)" if len(names) > MOST_LISTED else shown or "none"


def _check_names(names: Sequence[str], path: Path) -> None:
    seen: set[str] = set()
    for number, name in enumerate(names, 1):
        if not name:
            after = f" after {printable(names[number - 2])}" if number > 1 else ""
            raise InputError(
                f"{path}: column {number}{after} has no name (a separator too many in each line?)"
            )
        if "\t" in name:
            raise InputError(f"{path}: commas or semicolons separate columns, got tabs")
        if name in seen:
            raise InputError(f"{path}: two columns are called {short(name)}")
        seen.add(name)


def _check_size(rows: int, columns: int, path: Path) -> None:
    if rows > MOST_ROWS:
        raise InputError(f"{path}: more than {MOST_ROWS} rows")
    if columns > MOST_COLUMNS:
        raise InputError(f"{path}: {columns} columns, at most {MOST_COLUMNS} are read")
    if rows * columns > MOST_VALUES:
        raise InputError(f"{path}: {rows} rows of {columns} columns, at most {MOST_VALUES} numbers")


def _read_parquet(path: Path) -> dict[str, list[float]]:
    try:
        from pyarrow import ArrowException, float64, types
        from pyarrow.parquet import ParquetFile
    except ImportError:
        raise InputError(f"{path}: Parquet files need pyarrow: [parquet]") from None
    columns = {}
    try:
        with ParquetFile(path) as file:
            # its sizes are known before anything is unpacked
            _check_size(file.metadata.num_rows, file.metadata.num_columns, path)
            _check_names(file.schema_arrow.names, path)
            table = file.read()
        for name, column in zip(table.column_names, table.columns, strict=True):
            where = f"{path}: {printable(name)}"
            if types.is_dictionary(column.type):
                column = column.cast(column.type.value_type)
            kind = column.type
            if not (types.is_integer(kind) or types.is_floating(kind) or types.is_decimal(kind)):
                got = short(str(kind))[1:-1]
                raise InputError(f"{where}: numbers were expected, got a column of {got}")
            columns[name] = column.cast(float64(), safe=False).to_pylist()
            for row, value in enumerate(columns[name], 1):
                if value is None or not math.isfinite(value):
                    got = "none" if value is None else value
                    raise InputError(
                        f"{path}: row {row}: {printable(name)}: a number was expected, got {got}"
                    )
    except InputError:
        raise
    except (ArrowException, OSError, ValueError, MemoryError):
        raise InputError(f"{path}: damaged, or not a Parquet file") from None
    return columns


def _number(cell: str, where: str, has_commas: bool) -> float:
    text = cell.replace(",", ".") if has_commas else cell
    try:
        # Python also reads 1_0 and other digits than these
        value = float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        is_comma = "," in cell and not has_commas
        comma = " (columns with decimal commas are separated by semicolons)" if is_comma else ""
        raise InputError(f"{where}: a number was expected, got {short(cell.strip())}{comma}")
    return value
