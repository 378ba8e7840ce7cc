"""Columns of CSV and Parquet files: what is read, and what is said of what is not."""

from __future__ import annotations

from datetime import datetime, timezone
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from space_robot_msgs_py.config.columns import MOST_ROWS, read_columns
from space_robot_msgs_py.errors import InputError


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_columns(path)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: ")
    return line.removeprefix(f"{path}: ")


@pytest.mark.parametrize(
    "text", ["time,x\n0,0.5\n1,1e3\n", "time;x\n0;0,5\n1;1e3\n", "\ufefftime ;x\n0;.5\n\n1;1000\n"]
)
def test_commas_or_semicolons_separate_numbers(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text, "utf-8")
    assert read_columns(path) == {"time": [0.0, 1.0], "x": [0.5, 1000.0]}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("\n\n\n", "the file is empty"),
        ("  \n", "column 1 has no name"),
        ("time,x,\n0,1,\n", "column 3 after x has no name (a separator too many in each line?)"),
        ("time,x\n0,1,\n", "line 2: 2 cells expected, got 3 (time, x; the last one is empty: a "),
        ("time,x\n\n0,1\n\n1,z\n", "line 5: x: a number was expected, got 'z'"),
        ('time,x\n0,"0,5"\n', "line 2: x: a number was expected, got '0,5' (columns with decimal "),
        ("time,x\n0,1_0\n", "line 2: x: a number was expected, got '1_0'"),
        ("time,x\n0,\u0661\n", "line 2: x: a number was expected, got '\u0661'"),
        ("time;x\n0;1.234,5\n", "line 2: x: a number was expected, got '1.234,5'"),
        ("time\tx\n0\t1\n", "commas or semicolons separate columns, got tabs"),
        ("time,x,x\n", "two columns are called 'x'"),
        ("time,x\n" + "0,1\n" * (MOST_ROWS + 1), "more than 100000 rows"),
        (",".join(f"c{k}" for k in range(20_000)), "20000 columns, at most 1000 are read"),
        (",".join(f"c{k}" for k in range(20)) + ("\n" + ",".join("0" * 20)) * 10_000, "10000 rows"),
    ],
    ids=range(15),
)
def test_wrong_csv_files(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    assert refusal(path).startswith(said)


def parquet(path: Path, values: Any) -> Path:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow.parquet import write_table

    write_table(pyarrow.table({"time": pyarrow.array(range(len(values))), "x": values}), path)
    return path


KINDS: dict[str, list[Any]] = {
    "string": ["1", "2"],
    "list<element: double>": [[1.0], [2.0]],
    "struct<a: int64>": [{"a": 1}, {"a": 2}],
    "timestamp[us, tz=UTC]": [datetime(2026, 1, 1, tzinfo=timezone.utc)] * 2,
    "bool": [True, False],
    "null": [None, None],
}


@pytest.mark.parametrize(
    ("values", "said"),
    [
        *((v, f"x: numbers were expected, got a column of {kind}") for kind, v in KINDS.items()),
        *(([1.0, v, 2.0], "row 2: x: a number was expected, got n") for v in (None, float("nan"))),
    ],
)
def test_columns_that_are_no_numbers_are_named(tmp_path: Path, values: Any, said: str) -> None:
    assert refusal(parquet(tmp_path / "a.parquet", values)).startswith(said)


def test_all_kinds_of_numbers_are_read(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    for values in (
        [1, 2],
        [1.0, 2.0],
        [Decimal(1), Decimal(2)],
        pyarrow.array([1, 2]).dictionary_encode(),
        pyarrow.array([1.0, 2.0], pyarrow.float32()),
    ):
        path = parquet(tmp_path / "a.parquet", values)
        assert read_columns(path) == {"time": [0.0, 1.0], "x": [1.0, 2.0]}


def test_too_many_rows_are_refused_before_they_are_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = parquet(tmp_path / "a.parquet", np.zeros(MOST_ROWS + 1))
    from pyarrow.parquet import ParquetFile

    monkeypatch.delattr(ParquetFile, "read")
    assert refusal(path) == "more than 100000 rows"
