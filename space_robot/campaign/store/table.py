"""The table of a campaign in Parquet format: the same rows give the same bytes.

A second file has its digest and that of the campaign; ``sha256sum -c`` can read it.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.errors import InputError

from ...console.files import atomic_file
from ..row.row import Row
from .schema import Kind, Schema

if TYPE_CHECKING:
    import pyarrow
    from pandas import DataFrame

ROW_GROUP = 2000
"""Number of rows in memory at a time."""
SHA256 = ".sha256"
"""Suffix of the file with a table's digest."""


def check_tables() -> None:
    """Check that the packages for writing tables are installed.

    Raises:
        InputError: a package is not installed.
    """
    try:
        import pandas  # noqa: F401
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"a campaign's table needs {error.name}: {install_command('campaign')}"
        ) from None


def write_table(path: Path, schema: Schema, campaign: str, rows: Iterable[Row]) -> str:
    """Write the table and its digest atomically; an older table is replaced.

    Args:
        path: of the file.
        schema: its columns.
        campaign: digest `Manifest.campaign`.
        rows: in order; only a few of them are in memory at a time.

    Returns:
        The digest of the file, see `file_digest`.

    Raises:
        InputError: the table cannot be written.
    """
    from pyarrow.parquet import ParquetWriter

    columns = _arrow_schema(schema)
    remaining = iter(rows)
    with (
        atomic_file(path, replace=True) as file,
        ParquetWriter(
            file,
            columns,
            version="2.6",
            compression="zstd",
            compression_level=3,
            data_page_version="1.0",
            store_schema=False,
        ) as writer,
    ):
        while group := list(itertools.islice(remaining, ROW_GROUP)):
            writer.write_batch(_batch(group, schema, columns), row_group_size=ROW_GROUP)
    digest = file_digest(path)
    with atomic_file(_digest_of(path), replace=True) as file:
        file.write(_digest_text(path, campaign, digest).encode())
    return digest


def check_table(path: Path, campaign: str) -> None:
    """Check that a table is unmodified, and belongs to a campaign.

    Raises:
        InputError: it is modified, of another campaign, or missing.
    """
    check_there(path)
    digest = _digest_of(path)
    with suppress(OSError, UnicodeDecodeError):
        if digest.read_text("utf-8") == _digest_text(path, campaign, file_digest(path)):
            return
    raise InputError(
        f"{path}: damaged, or of another campaign: its digest is not that in {digest.name}"
    )


def check_there(path: Path) -> None:
    """Check that a table exists.

    Raises:
        InputError: it does not exist.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file: the campaign has no table yet")


def read_table(path: Path, schema: Schema) -> DataFrame:
    """Read a table as a data frame.

    Args:
        path: of the file, see `check_table`.
        schema: its columns.

    Raises:
        InputError: it is missing, cannot be read, or has other columns.
    """
    check_tables()
    from pandas import read_parquet
    from pyarrow import ArrowException

    check_there(path)
    try:
        frame: DataFrame = read_parquet(path, engine="pyarrow")
    except (OSError, ValueError, ArrowException) as error:
        raise InputError(f"{path}: cannot be read ({' '.join(str(error).split())})") from None
    if list(frame) != [name for name, _ in schema.columns()]:
        raise InputError(f"{path}: damaged: it does not have the campaign's columns")
    return frame


def table_rows(path: Path, schema: Schema) -> Iterator[Row]:
    """Yield the rows of an undamaged table, with full precision."""
    from pyarrow.parquet import ParquetFile

    for batch in ParquetFile(path).iter_batches(ROW_GROUP):
        yield from map(schema.row, batch.to_pylist())


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file; empty if it does not exist."""
    if not path.is_file():
        return ""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while part := file.read(2**20):
            digest.update(part)
    return digest.hexdigest()


def _digest_of(path: Path) -> Path:
    return path.with_name(path.name + SHA256)


def _digest_text(path: Path, campaign: str, digest: str) -> str:
    return f"# campaign {campaign}\n{digest}  {path.name}\n"


def _arrow_schema(schema: Schema) -> pyarrow.Schema:
    import pyarrow

    kinds: dict[Kind, Any] = {
        "int64": pyarrow.int64(),
        "float64": pyarrow.float64(),
        "str": pyarrow.string(),
        "float32s": pyarrow.list_(pyarrow.float32()),
    }
    return pyarrow.schema([(name, kinds[kind]) for name, kind in schema.columns()])


def _batch(rows: list[Row], schema: Schema, columns: pyarrow.Schema) -> pyarrow.RecordBatch:
    import pyarrow

    values = zip(*(schema.values(row) for row in rows), strict=True)
    return pyarrow.record_batch(
        [pyarrow.array(v, field.type) for v, field in zip(values, columns, strict=True)],
        schema=columns,
    )
