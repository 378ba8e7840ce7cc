"""A flight as a CSV or Parquet file: whole or not at all, and never over another one."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from io import TextIOWrapper
from pathlib import Path
from tempfile import mkstemp
from typing import IO, Any

import numpy as np

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from .columns import batches, column_names, metadata

METADATA_KEY = b"space_robot"
"""The key of the flight's description, as JSON, in the metadata of a Parquet file's schema."""


def check_free(path: Path) -> None:
    """See that a file can be made there, before any work is done for it.

    Raises:
        InputError: it exists, or its folder cannot be made or written.
    """
    if path.exists():
        raise InputError(f"{path}: exists already; it is not overwritten")
    make_folder(path.parent)
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise InputError(f"{path}: cannot be written (no permission for its folder)")


def make_folder(path: Path) -> None:
    """Make a folder, and those above it, where they are not there yet.

    Raises:
        InputError: it cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: no folder can be made there ({error.strerror})") from None


def check_parquet() -> None:
    """See that Parquet files can be written, before any work is done for them.

    Raises:
        InputError: pyarrow is not installed.
    """
    if find_spec("pyarrow") is None:
        raise InputError("Parquet files need pyarrow: pip install 'space_robot[parquet]'")


def write_csv(log: FlightLog, path: Path) -> None:
    """Write the columns of `analysis.columns` as text; a number that is not known is empty.

    Raises:
        InputError: the file exists or cannot be written.
    """
    with whole_file(path) as raw, TextIOWrapper(raw, encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(column_names(log))
        for ticks, numbers in batches(log):
            texts = numbers.astype(object)
            texts[np.isnan(numbers)] = None
            writer.writerows(np.column_stack([ticks.astype(object), texts]).tolist())


def write_parquet(log: FlightLog, path: Path) -> None:
    """Write the columns of `analysis.columns`; the schema's metadata describes the flight.

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
        whole_file(path) as file,
        parquet.ParquetWriter(file, schema, compression="zstd", use_dictionary=False) as writer,
    ):
        for ticks, numbers in batches(log):
            columns = [pa.array(np.ascontiguousarray(c), from_pandas=True) for c in numbers.T]
            writer.write_batch(pa.record_batch([pa.array(ticks), *columns], schema=schema))


def write_text(text: str, path: Path) -> None:
    """Write ``text`` in UTF-8.

    Raises:
        InputError: the file exists or cannot be written.
    """
    with whole_file(path) as file:
        file.write(text.encode())


@contextmanager
def whole_file(path: Path, replace: bool = False) -> Iterator[IO[Any]]:
    """Open a file that takes its name only when all is in it.

    Args:
        path: its name, which must not be taken yet; a pipe or device is written as it is.
        replace: whether an older file of that name is replaced.

    Raises:
        InputError: the file exists, or it cannot be written.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        with _told(path), path.open("wb") as file:
            yield file
        return
    if not replace:
        check_free(path)
    with _told(path):
        descriptor, name = mkstemp(dir=path.parent, prefix=f".{path.name}.")
        unnamed = Path(name)
        try:
            with os.fdopen(descriptor, "wb") as file:
                yield file
            unnamed.chmod(0o666 & ~_umask())
            if replace:
                unnamed.replace(path)
            else:
                os.link(unnamed, path)  # a rename would overwrite
        finally:
            with suppress(OSError):
                unnamed.unlink()


@contextmanager
def _told(path: Path) -> Iterator[None]:
    try:
        yield
    except FileExistsError:
        raise InputError(f"{path}: exists already; it is not overwritten") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
