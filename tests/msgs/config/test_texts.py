"""Texts and values from outside: how they are checked, shown and suggested, a line each."""

from __future__ import annotations

import importlib.metadata
import re
import shlex
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field

from space_robot_msgs_py.config.arguments import as_numbers, as_path, as_whole_number, path_text
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.config.text import (
    MOST_LISTED,
    choices,
    nearest,
    one_line_of,
    printable,
    shortened,
)
from space_robot_msgs_py.config.validation import (
    StrictModel,
    full_namespace,
    one_of,
    relative,
    short,
    validate,
)
from space_robot_msgs_py.errors import InputError

# Texts


@given(st.text(max_size=60), st.integers(5, 60))
def test_texts_are_shown_in_letters_that_can_be_shown_with_both_ends(text: str, most: int) -> None:
    assert printable(text) == "".join(c if c.isprintable() else "?" for c in text)
    shown = shortened(text, most)
    assert (shown == text) == (len(text) <= most) or "..." in text
    if shown != text:
        begin, _, end = shown[: (most - 2) // 2], 0, shown[(most - 2) // 2 + 3 :]
        assert len(shown) == most
        assert 0 <= len(begin) - len(end) <= 1
        assert shown == f"{begin}...{end}"
        assert text.startswith(begin)
        assert text.endswith(end)


def test_errors_and_values_are_one_short_line() -> None:
    assert one_line_of(ValueError(" two\n lines\0")) == "ValueError: two lines?"
    assert one_line_of(KeyError()) == "KeyError"
    assert len(one_line_of(OSError("x" * 1000))) == 300
    assert short("x" * 78) == repr("x" * 78)
    assert short("x" * 79) == "'" + "x" * 76 + "..."
    assert short([1, 2]) == "[1, 2]"


@pytest.mark.parametrize(
    ("text", "namespace"),
    [("", "/"), ("/", "/"), ("sat1", "/sat1"), ("/sat1/", "/sat1"), ("_a/B_2", "/_a/B_2")],
)
def test_a_namespace_begins_with_a_slash_and_ends_without(text: str, namespace: str) -> None:
    assert full_namespace(text) == namespace


@pytest.mark.parametrize(
    "text", ["1a", "a/1", "a//b", "a__b", "a b", "ä", "a-b", "~a", "{node}", "a\n"]
)
def test_what_ros_does_not_take_is_no_namespace(text: str) -> None:
    with pytest.raises(
        InputError, match="is not a namespace: letters, digits and _ were expected, "
    ) as caught:
        full_namespace(text)
    assert str(caught.value).startswith(repr(text))


def test_names_relative_to_a_namespace() -> None:
    assert relative("/plant_node", "/") == "plant_node"
    assert relative("/a/b/plant_node", "/a/b") == "plant_node"
    for namespace in ("/", "/a", "/a/b/plant_node", "/b"):
        assert relative("/a/b/plant_node", namespace) == ""


# Suggestions


@pytest.mark.parametrize("meant", ["noise_gyro", "hold_ticks", "torque_scale", "tde_stc"])
def test_one_slip_of_the_finger_suggests_the_name_that_was_meant(meant: str) -> None:
    names = ["attitude", "bias_gyro", "clock_decimation", "ctc", "drop_state", meant, "Wheel_1"]
    for k in range(len(meant)):
        for slip in (meant[:k] + meant[k + 1 :], f"{meant[:k]}z{meant[k:]}", meant.upper()):
            assert nearest(slip, names)[0] == meant
    assert nearest("wheel_1", names) == ["Wheel_1"]
    assert nearest("qqqq", names) == []
    assert nearest("drop", names) == ["drop_state"], "a part of it"
    assert nearest("dr", names) == [], "from three letters on"


@settings(max_examples=20)
@given(
    st.lists(st.text("abcdefgh_", min_size=6, max_size=12), unique=True, max_size=60),
    st.text(max_size=200),
    st.booleans(),
)
def test_an_error_is_one_line_of_bounded_length(
    names: list[str], name: str, is_listed: bool
) -> None:
    text = choices(name, names, listing="--all" if is_listed else "")
    assert len(text) < 400
    assert text.isprintable()
    assert all(other in text for other in names) or f"{len(names)}" in text


def test_as_many_names_as_may_be_listed_are_listed() -> None:
    names = [f"name_{k}" for k in range(MOST_LISTED + 1)]
    for listing in ("", "--all"):
        assert choices("x", names[:-1], listing=listing) == f"choose one of {', '.join(names[:-1])}"
    assert names[-1] not in choices("x", names)
    assert one_of("a", ["a", "b"], "letter") == "a"
    with pytest.raises(InputError, match="unknown letter 'c' of x: choose one of a, b"):
        one_of("c", ["a", "b"], "letter", " of x")
    with pytest.raises(InputError, match="unknown link"):  # and takes no time
        one_of("a" * 100_000, [f"{k}_{'a' * 1000}" for k in range(10_000)], "link")


REQUIREMENTS = [
    "click>=8.1",
    'viser>=1.1; extra == "view"',
    'trimesh[easy]>=4 ; extra == "view"',
    "pymdown-extensions<12; python_full_version < '3.11.5' and extra == 'docs'",
]


def test_a_command_names_the_packages_of_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    for extra in ("campaign", "dask", "gym", "parquet", "view", "xacro"):
        words = shlex.split(install_command(extra))
        assert words[:2] == ["pip", "install"], extra
        assert all(re.match(r"[a-z]", word) for word in words[2:]), words
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: REQUIREMENTS)
    assert install_command("view") == "pip install 'viser>=1.1' 'trimesh[easy]>=4'"
    assert install_command("docs") == "pip install 'pymdown-extensions<12'"
    assert install_command("vie") == "pip install -e '.[vie]' in the folder of space_robot"

    def requires(name: str) -> list[str]:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", requires)
    assert install_command("view") == "pip install -e '.[view]' in the folder of space_robot"


# Arguments of public functions


@pytest.mark.parametrize(
    ("check", "value", "said"),
    [
        *((as_path, other, f"a path was expected, got {other!r}") for other in (1, None, b"a")),
        (path_text, ["one"], "a path was expected, got ['one']"),
        *(
            (as_numbers, other, "numbers were expected, got ")
            for other in (None, "1", [True], [1j], [[1.0], [1.0, 2.0]], [None], {})
        ),
        *(
            (
                lambda value, name: as_whole_number(value, name, 2, 5),
                value,
                f"2 to 5 is allowed, got {value}",
            )
            for value in (1, 6)
        ),
        (partial(as_whole_number, least=2), 1, "2 or more is allowed, got 1"),
        *(
            (partial(as_whole_number, least=0), value, "a whole number was expected, got ")
            for value in (True, np.True_, 3.0, "3", None)
        ),
    ],
)
def test_what_is_no_argument_is_told_by_its_name(
    check: Callable[[Any, str], object], value: Any, said: str
) -> None:
    with pytest.raises(InputError) as caught:
        check(value, "bag")
    assert str(caught.value).startswith(f"bag: {said}")


@pytest.mark.parametrize(
    "value", [1, 2.5, [1, 2], ((1, 2.0), (3, 4)), np.arange(3, dtype=np.uint8)]
)
def test_arguments_that_are_taken(value: Any) -> None:
    numbers = as_numbers(value, "action")
    assert (numbers.dtype, numbers.shape) == (np.float64, np.shape(value))
    assert numbers.tolist() == np.array(value).tolist()
    own = np.zeros(3)
    as_numbers(own, "action")[:] = 1.0
    assert not own.any(), "a copy"
    assert as_path("./one", "bag") == as_path(Path("one"), "bag") == Path("one")
    assert path_text("./one", "bag") == "./one"
    assert [as_whole_number(n, "ticks", 2, 5) for n in (2, np.int64(3), 5)] == [2, 3, 5]
    assert as_whole_number(10**30, "ticks", 2) == 10**30


# Content of files


class Typed(StrictModel):
    mass: float = 0.0
    ticks: int = 0
    on: bool = False
    name: str = ""
    names: list[str] = Field(default_factory=list)
    values: list[float] = Field(default_factory=list)


class Outer(StrictModel):
    inner: Typed = Field(default_factory=Typed)
    needed: float
    several: list[Typed] = Field(default_factory=list)


K = "choose one of mass, name, names, on, ticks, values"


@pytest.mark.parametrize(
    ("model", "content", "said"),
    [
        (Outer, {"neded": 1.0}, "neded: unknown key, got 1.0: choose one of inner, needed"),
        (Outer, {"neded": 1.0}, "(did you mean needed?) (and 1 more)"),
        (Outer, {"needed": 1, "several": [{}, {"x": 2}]}, f"several.1.x: unknown key, got 2: {K}"),
        (Typed, {"A9\U000feb58R": 1.0}, "A9?R: unknown key"),
        (Typed, {"mass": 10**400}, "mass: Input should be a valid number, got 1000"),
        (Typed, {"mass": 2**20_000}, "mass: Input should be a valid number, got a number of"),
        (Typed, {"ticks": True}, "ticks: Input should be a valid integer, got True"),
        (Typed, {"ticks": "1"}, "ticks: Input should be a valid integer, got '1'"),
        (Typed, {"values": [1.0, True]}, "values.1: Input should be a valid number, got True"),
        (Typed, {"values": {1.0}}, "values: Input should be a valid list"),
        (Typed, {5: 1}, "Keys should be strings"),
    ],
)
def test_what_does_not_fit_is_refused(
    model: type[StrictModel], content: dict[str, object], said: str
) -> None:
    with pytest.raises(InputError) as caught:
        validate(model, content, "file.yaml")
    assert said in str(caught.value)
    assert str(caught.value).startswith("file.yaml: ")
    assert str(caught.value).isprintable()


def test_numbers_may_stand_for_names_whole_ones_for_numbers_and_tuples_for_lists() -> None:
    content = {"mass": 750, "name": 4, "names": ("a", "b"), "values": (1, 2.5)}
    read = validate(Typed, content, "file.yaml")
    assert type(read.mass) is float
    assert (read.name, read.names) == ("4", ["a", "b"])
    assert [type(value) for value in read.values] == [float, float]
