"""What is said of a file that does not fit, beyond what pydantic says."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import Field

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.validation import Strict, check, one_of, read_yaml


class Inner(Strict):
    mass: float
    name: str = ""


class Outer(Strict):
    inner: Inner
    several: list[Inner] = Field(default_factory=list)


def test_misspelt_key_is_named_before_the_one_it_leaves_missing() -> None:
    with pytest.raises(InputError) as caught:
        check(Outer, {"inner": {"masss": 1.0}}, "file.yaml")
    assert str(caught.value) == (
        "file.yaml: inner.masss: unknown key, got 1.0: choose one of mass, name (and 1 more)"
    )


def test_unknown_key_in_a_list_lists_the_allowed_ones() -> None:
    content = {"inner": {"mass": 1.0}, "several": [{"mass": 1.0}, {"mass": 1.0, "x": 2}]}
    with pytest.raises(InputError, match=r"several\.1\.x: unknown key, got 2: choose one of mass"):
        check(Outer, content, "file.yaml")


def test_key_given_twice_is_an_error_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "twice.yaml"
    path.write_text("robot:\n  mass: 750.0\n  mass: 1.0\n")
    with pytest.raises(InputError, match=r"line 3: .*'mass' occurs twice"):
        read_yaml(path)


@pytest.mark.parametrize("content", ["- 1\n- 2\n", "", "42"])
def test_file_that_is_no_mapping(tmp_path: Path, content: str) -> None:
    path = tmp_path / "odd.yaml"
    path.write_text(content)
    with pytest.raises(InputError, match="a mapping was expected"):
        read_yaml(path)


def test_numbers_may_stand_for_names() -> None:
    assert check(Inner, {"mass": 1, "name": 4}, "file.yaml").name == "4"


def test_one_of() -> None:
    assert one_of("a", ["a", "b"], "letter") == "a"
    with pytest.raises(InputError, match="unknown letter 'c' of x: choose one of a, b"):
        one_of("c", ["a", "b"], "letter", " of x")
