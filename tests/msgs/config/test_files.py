"""Files that are read: YAML, strictly, and columns of CSV and Parquet; a line a mistake."""

from __future__ import annotations

import os
from datetime import datetime, timezone
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py.config.columns import MOST_ROWS, read_columns
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.config.yaml_text import (
    DEEPEST,
    LARGEST_FILE,
    YamlTextError,
    check_readable,
    parse_yaml,
    read_file,
)
from space_robot_msgs_py.errors import InputError


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e3", 1000.0),
        ("-1.5E3", -1500.0),
        (".5e-2", 0.005),
        ("1E+2", 100.0),
        ("1", 1),
        ("2020-01-02", "2020-01-02"),
        ("2020-13-45", "2020-13-45"),
        ("e3", "e3"),
        ("1e", "1e"),
        ("[a, {b: c}]", ["a", {"b": "c"}]),
        ("", None),
        ("{a: &a [1], b: *a}", {"a": [1], "b": [1]}),
        ("{a: &a {x: 1}, b: {<<: *a, y: 2}}", {"a": {"x": 1}, "b": {"x": 1, "y": 2}}),
        *((str(number), number) for number in (2**63, 2**64 - 1, -(2**63))),
    ],
)
def test_values(text: str, value: Any) -> None:
    read = parse_yaml(text)
    assert read == value
    assert type(read) is type(value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[1]: 2", "line 1: not YAML (a key must be a text or a number)"),
        ("a: 1\n? {b: c}\n: 2", "line 2: not YAML (a key must be a text or a number)"),
        ("a: 1\na: 2", "line 2: not YAML (the key 'a' occurs twice)"),
        ("!!int abc", "the value 'abc' is not of type int"),
        ("!!timestamp 2020-13-45", "the value '2020-13-45' is not of type timestamp"),
        ("!!map 5", "a mapping was expected"),
        ("!!python/object:os.system x", "could not determine a constructor"),
        (str(2**64), f"line 1: not YAML (the value '{2**64}' is not of type int"),
        (str(-(2**63) - 1), f"line 1: not YAML (the value '{-(2**63) - 1}' is not of type int"),
        ("{a: " * 20_000, f"nested deeper than {DEEPEST} levels"),
        ("&a [*a]", "the alias 'a' contains itself"),
        ("*a", "undefined alias"),
        ("\ud800", "not YAML"),
        ("a: b: c", "line 1: not YAML"),
        ("--- a\n--- b", "line 2: not YAML"),
    ],
)
def test_mistakes_have_one_line(text: str, said: str) -> None:
    with pytest.raises(YamlTextError) as caught:
        parse_yaml(text)
    assert said in str(caught.value)
    assert str(caught.value).isprintable()


_PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63)
    | st.floats(allow_nan=False)
    | st.text("abcäöü -_:/#[]{}'\"\\n1e5", max_size=12),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text("abc é", min_size=1, max_size=5), inner, max_size=4)
    ),
    max_leaves=20,
)


@given(_PLAIN)
def test_what_was_written_is_read(value: Any) -> None:
    assert parse_yaml(yaml.safe_dump(value, allow_unicode=True)) == value


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("missing", "no such file"),
        ("folder", "not a file"),
        ("pipe", "not a file"),
        ("bytes", "cannot be read"),
        ("large", "cannot be read (more than 16 MiB)"),
    ],
)
def test_what_is_no_readable_file(tmp_path: Path, kind: str, said: str) -> None:
    path = tmp_path / "it.yaml"
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind != "missing":
        path.write_bytes(b"a: \xff" if kind == "bytes" else bytes(LARGEST_FILE + 1))
    for read in (read_file, read_yaml, *([check_readable] if not path.is_file() else [])):
        with pytest.raises(InputError) as caught:
            read(path)
        assert said in str(caught.value)
        assert str(caught.value).isprintable()


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


COLUMNS: dict[str, list[Any]] = {
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
        *((v, f"x: numbers were expected, got a column of {kind}") for kind, v in COLUMNS.items()),
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
