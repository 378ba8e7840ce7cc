"""Names of variables, such as ``robot.links[*].mass``, and the elements that they select."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

ALL = "*"
_STEP = r"[^.\[\]]+(?:\[[^\[\]]+\])?"
_NAME = re.compile(rf"{_STEP}(?:\.{_STEP})*")
_PARTS = re.compile(r"([^.\[\]]+)(?:\[([^\[\]]+)\])?")


class NamePart(NamedTuple):
    """One word of a variable's name, with its element in brackets."""

    word: str
    element: str
    """Empty if there are no brackets."""


def parts_of(name: str) -> list[NamePart]:
    """Split a variable's name into its parts.

    Raises:
        InputError: invalid name.
    """
    if not _NAME.fullmatch(name):
        raise InputError(f"{short(name)} is not a variable name such as robot.links[*].mass")
    return [NamePart(*match) for match in _PARTS.findall(name)]


def chosen(element: str, names: Sequence[str], what: str) -> list[tuple[int, str]]:
    """Return index and name of each selected item.

    Args:
        element: a name, a number counted from 1, or ``*`` for all.
        names: of all items.
        what: kind of the items, for errors.

    Raises:
        InputError: there is no such item; lists the existing ones.
    """
    if element == ALL:
        return list(enumerate(names))
    if element in names:
        return [(names.index(element), element)]
    if element.isdecimal() and 1 <= int(element) <= len(names):
        return [(int(element) - 1, names[int(element) - 1])]
    raise InputError(
        f"no {what} {short(element)}: {choices(element, names, f', 1 to {len(names)}, or *')}"
        if names
        else f"no {what} {short(element)}: there are none"
    )
