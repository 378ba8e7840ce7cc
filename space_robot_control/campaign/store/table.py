"""The table of a campaign as Parquet: the same rows give the same bytes."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.errors import InputError

from ...analysis.files import whole_file
from ..row.row import Row
from .schema import Kind, Schema

if TYPE_CHECKING:
    import pyarrow
    from pandas import DataFrame

ROW_GROUP = 2000
"""Rows that are in memory at a time."""


def check_tables() -> None:
    """See that tables can be written, before anything is flown for one.

    Raises:
        InputError: a package is not installed.
    """
    try:
        import pandas  # noqa: F401
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"a campaign's table needs {error.name}: pip install 'space_robot[campaign]'"
        ) from None


def write_table(path: Path, schema: Schema, rows: Iterable[Row]) -> str:
    """Write the rows, whole or not at all, over an older table.

    Args:
        path: of the file.
        schema: its columns.
        rows: in their order; a few of them are in memory at a time.

    Returns:
        The digest of the file, see `file_digest`.

    Raises:
        InputError: it cannot be written.
    """
    from pyarrow.parquet import ParquetWriter

    columns = _arrow_schema(schema)
    remaining = iter(rows)
    with (
        whole_file(path, replace=True) as file,
        ParquetWriter(
            file, columns, version="2.6", compression="zstd", compression_level=3,
            data_page_version="1.0", store_schema=False,
        ) as writer,
    ):  # fmt: skip
        while group := list(itertools.islice(remaining, ROW_GROUP)):
            writer.write_batch(_batch(group, schema, columns), row_group_size=ROW_GROUP)
    return file_digest(path)


def read_table(path: Path) -> DataFrame:
    """Read a table as a data frame.

    Raises:
        InputError: it is not there or cannot be read.
    """
    check_tables()
    from pandas import read_parquet

    if not path.is_file():
        raise InputError(f"{path}: no such file: the campaign has no table yet")
    try:
        found: DataFrame = read_parquet(path, engine="pyarrow")
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({' '.join(str(error).split())})") from None
    return found


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file; empty if there is none."""
    if not path.is_file():
        return ""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while part := file.read(2**20):
            digest.update(part)
    return digest.hexdigest()


def _arrow_schema(schema: Schema) -> pyarrow.Schema:
    import pyarrow

    kinds: dict[Kind, Any] = {
        "int64": pyarrow.int64(), "float64": pyarrow.float64(), "str": pyarrow.string(),
        "float32s": pyarrow.list_(pyarrow.float32()),
    }  # fmt: skip
    return pyarrow.schema([(name, kinds[kind]) for name, kind in schema.columns()])


def _batch(rows: list[Row], schema: Schema, columns: pyarrow.Schema) -> pyarrow.RecordBatch:
    import pyarrow

    values = zip(*(schema.values(row) for row in rows), strict=True)
    return pyarrow.record_batch(
        [pyarrow.array(v, field.type) for v, field in zip(values, columns, strict=True)],
        schema=columns,
    )
