"""YAML read strictly: one line for each mistake."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.config.yaml_text import (
    DEEPEST,
    LARGEST_FILE,
    YamlTextError,
    check_file,
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
        ("!!int ''", "the value '' is not of type int"),
        ("!!bool x", "the value 'x' is not of type bool"),
        ("!!timestamp 2020-13-45", "the value '2020-13-45' is not of type timestamp"),
        ("!!map 5", "a mapping was expected"),
        ("!!python/object:os.system x", "could not determine a constructor"),
        ("9" * 5000, "is not of type int"),
        (str(2**64), f"line 1: not YAML (the value '{2**64}' is not of type int"),
        (str(-(2**63) - 1), f"line 1: not YAML (the value '{-(2**63) - 1}' is not of type int"),
        ("{a: " * 20_000, f"nested deeper than {DEEPEST} levels"),
        ("&a [*a]", "the alias 'a' contains itself"),
        ("*a", "undefined alias"),
        ("a: \0", "not YAML"),
        ("\ud800", "not YAML"),
        ("a: b: c", "line 1: not YAML"),
        ("--- a\n--- b", "line 2: not YAML"),
        ("[", "not YAML"),
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
        ("device", "not a file"),
        ("long", "cannot be read (File name too long)"),
        ("nul", "cannot be read"),
        ("bytes", "cannot be read"),
        ("large", "cannot be read (more than 16 MiB)"),
    ],
)
def test_what_is_no_readable_file(tmp_path: Path, kind: str, said: str) -> None:
    odd = {"device": Path("/dev/zero"), "long": Path("a" * 300), "nul": Path("a\0b")}
    path = odd.get(kind, tmp_path / "it.yaml")
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "bytes":
        path.write_bytes(b"a: \xff")
    elif kind == "large":
        with path.open("wb") as file:
            file.truncate(LARGEST_FILE + 1)
    before = len(os.listdir("/proc/self/fd"))
    readers = (read_file, read_yaml, check_file)
    for read in readers[:2] if kind in ("bytes", "large") else readers:
        with pytest.raises(InputError) as caught:
            read(path)
        assert said in str(caught.value)
        assert str(caught.value).isprintable()
        assert len(str(caught.value)) < 400
    assert len(os.listdir("/proc/self/fd")) == before, "none is left open"
