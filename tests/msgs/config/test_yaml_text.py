"""YAML read strictly: one line for each mistake, and nothing that takes for ever."""

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
    LONGEST_NAME,
    MOST_REPEATED,
    MOST_VALUES,
    YamlTextError,
    check_file,
    parse_yaml,
    read_file,
)
from space_robot_msgs_py.errors import InputError

BOMB = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)
MERGED_BOMB = "a: &a {x: 1}\n" + "".join(
    f"{name}: &{name} {{<<: [{', '.join([f'*{before}'] * 9)}]}}\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


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
        ("&a [1, *b]".replace("*b", "2"), [1, 2]),
        ("{a: &a [1], b: *a}", {"a": [1], "b": [1]}),
        ("{a: &a {x: 1}, b: {<<: *a, y: 2}}", {"a": {"x": 1}, "b": {"x": 1, "y": 2}}),
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
        ("0x" + "f" * 5000, "is not of type int"),
        ("[" + "1," * MOST_VALUES + "1]", f"more than {MOST_VALUES} values"),
        ("[" * 20_000, f"nested deeper than {DEEPEST} levels"),
        ("{a: " * 20_000, f"nested deeper than {DEEPEST} levels"),
        ("- " * 20_000, f"nested deeper than {DEEPEST} levels"),
        (BOMB, "aliases repeat more than"),
        (MERGED_BOMB, "aliases repeat more than"),
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


@pytest.mark.parametrize(
    ("allowed", "refused"),
    [
        ("[" + "1," * (MOST_VALUES - 1) + "]", "[" + "1," * MOST_VALUES + "1]"),
        ("[" * DEEPEST + "]" * DEEPEST, "[" * (DEEPEST + 1) + "]" * (DEEPEST + 1)),
        (
            f"[&a [{'1,' * 999}], {'*a,' * (MOST_REPEATED // 1000)}]",
            f"[&a [{'1,' * 999}], &b 1, *b, {'*a,' * (MOST_REPEATED // 1000)}]",
        ),
    ],
    ids=["values", "levels", "repeated"],
)
def test_as_much_as_is_allowed_is_read(allowed: str, refused: str) -> None:
    assert parse_yaml(allowed) is not None
    with pytest.raises(YamlTextError, match=r"more than|deeper than"):
        parse_yaml(refused)


@pytest.mark.parametrize("text", [str(2**63), str(2**64 - 1), str(-(2**63))])
def test_whole_numbers_of_64_bits_are_read(text: str) -> None:
    assert parse_yaml(text) == int(text)


@pytest.mark.parametrize("text", [str(2**64), str(-(2**63) - 1)])
def test_larger_whole_numbers_are_refused(text: str) -> None:
    with pytest.raises(
        YamlTextError, match=f"line 1: not YAML .the value '{text}' is not of type int"
    ):
        parse_yaml(text)


def test_no_more_than_aliases_is_repeated() -> None:
    """Few values, many times: still bounded where they are looked at one by one."""
    value = parse_yaml("a: &a [1, 2, 3]\nb: [" + "*a, " * 1000 + "]")
    assert len(value["b"]) == 1000


_WORDS = st.sampled_from(
    [
        "a",
        "b:",
        "- ",
        "[",
        "]",
        "{",
        "}",
        ",",
        ": ",
        "&a ",
        "*a",
        "!!int ",
        "!!map ",
        "!!set ",
        "!!float ",
        "!!binary ",
        "!x ",
        "<<: ",
        "? ",
        "|",
        ">",
        "\n",
        "\n  ",
        "'",
        '"',
        "#",
        "%",
        "@",
        "1",
        "1e9999",
        ".nan",
        "-.inf",
        "0x",
        "1:30",
        "2020-13-45",
        "~",
        "---\n",
        "...",
        "\t",
        "é",
        "\0",
        "\x7f",
        "true",
        "yes",
        "=",
        "9" * 30,
    ]
)


@given(st.lists(_WORDS, max_size=30).map("".join) | st.text(max_size=50))
def test_any_text_is_read_or_refused_in_one_line(text: str) -> None:
    try:
        parse_yaml(text)
    except YamlTextError as error:
        assert str(error).isprintable()  # noqa: PT017


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


@pytest.mark.parametrize("kind", ["missing", "folder", "pipe", "device", "long", "nul", "bytes"])
def test_what_is_no_readable_file(tmp_path: Path, kind: str) -> None:
    path = {"device": Path("/dev/zero"), "long": Path("a" * 300), "nul": Path("a\0b")}.get(
        kind, tmp_path / "it.yaml"
    )
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "bytes":
        path.write_bytes(b"a: \xff")
    for read in (read_file, read_yaml) if kind == "bytes" else (read_file, read_yaml, check_file):
        with pytest.raises(InputError) as caught:
            read(path)
        assert str(caught.value).isprintable()
        assert len(str(caught.value)) < 400


def test_file_beyond_measure(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    with path.open("wb") as file:
        file.truncate(LARGEST_FILE + 1)
    with pytest.raises(InputError, match="more than 16 MiB"):
        read_yaml(path)
    with path.open("wb") as file:
        file.truncate(LARGEST_FILE)
    assert len(read_file(path)) == LARGEST_FILE


def test_a_long_name_is_shown_by_its_ends() -> None:
    for length in (LONGEST_NAME, LONGEST_NAME + 1):
        name = f"b/{'a' * (length - 7)}/no.e"[-length:]
        with pytest.raises(InputError) as caught:
            read_file(Path(name))
        shown = name if length == LONGEST_NAME else f"{name[:40]}...{name[-40:]}"
        assert str(caught.value) == f"{shown}: no such file"


def test_reading_leaves_no_file_open(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("a: 1")
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        check_file(path)
        with pytest.raises(InputError, match="not a file"):
            check_file(tmp_path)
    assert len(os.listdir("/proc/self/fd")) == before
