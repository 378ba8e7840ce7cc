"""What is said of a file that does not fit, beyond what pydantic says."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel, one_of, read_yaml, validate
from space_robot_msgs_py.errors import InputError


class Inner(StrictModel):
    mass: float
    name: str = ""


class Outer(StrictModel):
    inner: Inner
    several: list[Inner] = Field(default_factory=list)


def test_misspelt_key_is_named_before_the_one_it_leaves_missing() -> None:
    with pytest.raises(InputError) as caught:
        validate(Outer, {"inner": {"masss": 1.0}}, "file.yaml")
    assert str(caught.value) == (
        "file.yaml: inner.masss: unknown key, got 1.0: choose one of mass, name "
        "(did you mean mass?) (and 1 more)"
    )


def test_unknown_key_in_a_list_lists_the_allowed_ones() -> None:
    content = {"inner": {"mass": 1.0}, "several": [{"mass": 1.0}, {"mass": 1.0, "x": 2}]}
    with pytest.raises(InputError, match=r"several\.1\.x: unknown key, got 2: choose one of mass"):
        validate(Outer, content, "file.yaml")


def test_an_unknown_key_is_shown_in_letters_that_can_be_shown() -> None:
    with pytest.raises(InputError, match=r"inner\.A9\?R: unknown key") as caught:
        validate(Outer, {"inner": {"A9\U000feb58R": 1.0}}, "file.yaml")
    assert str(caught.value).isprintable()


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
    assert validate(Inner, {"mass": 1, "name": 4}, "file.yaml").name == "4"


class Typed(StrictModel):
    mass: float = 0.0
    ticks: int = 0
    on: bool = False
    names: list[str] = Field(default_factory=list)
    values: list[float] = Field(default_factory=list)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"mass": True}, "mass: Input should be a valid number, got True"),
        ({"mass": "750"}, "mass: Input should be a valid number, got '750'"),
        ({"mass": float("inf")}, "mass: Input should be a finite number, got inf"),
        ({"mass": float("nan")}, "mass: Input should be a finite number, got nan"),
        ({"mass": None}, "mass: Input should be a valid number, got None"),
        ({"mass": 10**400}, "mass: Input should be a valid number, got 1000"),
        ({"mass": 2**20_000}, "mass: Input should be a valid number, got a number of type int"),
        ({"ticks": 1.5}, "ticks: Input should be a valid integer, got 1.5"),
        ({"ticks": True}, "ticks: Input should be a valid integer, got True"),
        ({"ticks": "1"}, "ticks: Input should be a valid integer, got '1'"),
        ({"on": 1}, "on: Input should be a valid boolean, got 1"),
        ({"on": "yes"}, "on: Input should be a valid boolean, got 'yes'"),
        ({"names": "abc"}, "names: Input should be a valid list, got 'abc'"),
        ({"values": [1.0, True]}, "values.1: Input should be a valid number, got True"),
        ({"values": {1.0}}, "values: Input should be a valid list"),
        ({5: 1}, "Keys should be strings"),
    ],
)
def test_values_of_another_type_are_refused(content: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as caught:
        validate(Typed, content, "file.yaml")
    assert said in str(caught.value)
    assert str(caught.value).isprintable()


def test_whole_numbers_are_numbers_and_tuples_lists() -> None:
    read = validate(Typed, {"mass": 750, "names": ("a", "b"), "values": (1, 2.5)}, "file.yaml")
    assert type(read.mass) is float
    assert read.names == ["a", "b"]
    assert [type(value) for value in read.values] == [float, float]


_ANY = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4) | st.binary(),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text("abmns", max_size=3) | st.integers(), inner, max_size=3)
    ),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from([*Typed.model_fields, "x", 5, None]), _ANY))
def test_any_content_fits_or_is_refused_in_one_line(content: dict[object, object]) -> None:
    try:
        read = validate(Typed, content, "file.yaml")
    except InputError as error:
        assert len(str(error).splitlines()) == 1  # noqa: PT017
    else:
        for name, value in content.items():
            assert getattr(read, str(name)) == value
            assert type(value) is not bool or name == "on"


def test_one_of() -> None:
    assert one_of("a", ["a", "b"], "letter") == "a"
    with pytest.raises(InputError, match="unknown letter 'c' of x: choose one of a, b"):
        one_of("c", ["a", "b"], "letter", " of x")
