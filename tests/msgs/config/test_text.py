"""Texts from outside as they are shown, and names of ROS within their namespaces."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py.config.namespace import full_namespace, relative
from space_robot_msgs_py.config.text import one_line_of, printable, shortened
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError


@given(st.text(max_size=40))
def test_every_letter_that_cannot_be_shown_is_a_question_mark(text: str) -> None:
    assert printable(text).isprintable()
    for letter, shown in zip(text, printable(text), strict=True):
        assert shown == (letter if letter.isprintable() else "?")


@given(st.text(max_size=60), st.integers(5, 60))
def test_a_shortened_text_has_both_ends_of_the_whole(text: str, most: int) -> None:
    shown = shortened(text, most)
    if len(text) <= most:
        assert shown == text
        return
    assert len(shown) == most
    begin, end = shown[: (most - 2) // 2], shown[(most - 2) // 2 + 3 :]
    assert 0 <= len(begin) - len(end) <= 1
    assert shown == f"{begin}...{end}"
    assert text.startswith(begin)
    assert text.endswith(end)


def test_an_error_of_a_program_is_one_line() -> None:
    assert one_line_of(ValueError(" two\n lines\0")) == "ValueError: two lines?"
    assert one_line_of(KeyError()) == "KeyError"
    assert len(one_line_of(OSError("x" * 1000))) == 300


def test_a_value_is_shown_in_at_most_eighty_characters() -> None:
    assert short("x" * 78) == repr("x" * 78)
    assert short("x" * 79) == "'" + "x" * 76 + "..."
    assert short([1, 2]) == "[1, 2]"


@pytest.mark.parametrize(
    ("text", "namespace"),
    [("", "/"), ("/", "/"), ("sat1", "/sat1"), ("/sat1/", "/sat1"), ("_a/B_2", "/_a/B_2")],
)
def test_a_namespace_begins_with_a_slash_and_ends_without(text: str, namespace: str) -> None:
    assert full_namespace(text) == namespace


@pytest.mark.parametrize("text", ["1a", "a/1", "a//b", "a__b", "a b", "ä", "a-b", "~a", "a\n"])
def test_what_ros_does_not_take_is_no_namespace(text: str) -> None:
    with pytest.raises(InputError, match="is not a namespace: letters, digits and _") as caught:
        full_namespace(text)
    assert str(caught.value).startswith(repr(text))


def test_names_relative_to_a_namespace() -> None:
    assert relative("/plant_node", "/") == "plant_node"
    assert relative("/a/b/plant_node", "/a/b") == "plant_node"
    for namespace in ("/", "/a", "/a/b/plant_node", "/b"):
        assert relative("/a/b/plant_node", namespace) == ""
