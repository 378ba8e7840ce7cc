"""A flight as a table of pandas; as a CSV or Parquet file, whole or not at all, over no other."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.errors import InputError

from ..console.files import csv_rows, csv_writer, whole_file
from .columns import batches, column_names, metadata

if TYPE_CHECKING:
    from pandas import DataFrame

METADATA_KEY = b"space_robot"
"""The key of the flight's description, as JSON, in the metadata of a Parquet file's schema."""


def dataframe(log: FlightLog) -> DataFrame:
    """Return the columns of `analysis.columns`, a row a tick; NaN is a number that is not known.

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
    """Write the columns of `analysis.columns` as text; a number that is not known is empty.

    Raises:
        InputError: the file exists or cannot be written.
    """
    with csv_writer(path) as writer:
        writer.writerow(column_names(log))
        for ticks, numbers in batches(log):
            writer.writerows(csv_rows(ticks, numbers))


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
