"""Names of variables: ``robot.links[*].mass``, and the things that they mean."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from space_robot_msgs_py.config.choices import choices
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

ALL = "*"
_STEP = r"[^.\[\]]+(?:\[[^\[\]]+\])?"
_NAME = re.compile(rf"{_STEP}(?:\.{_STEP})*")
_PARTS = re.compile(r"([^.\[\]]+)(?:\[([^\[\]]+)\])?")


class NamePart(NamedTuple):
    """A word of a name, and which element of it is meant."""

    word: str
    element: str
    """Empty: none is named."""


def parts_of(name: str) -> list[NamePart]:
    """Take a variable's name apart.

    Raises:
        InputError: it is none.
    """
    if not _NAME.fullmatch(name):
        raise InputError(f"{short(name)} is no name of a variable, as robot.links[*].mass is one")
    return [NamePart(*match) for match in _PARTS.findall(name)]


def chosen(element: str, names: Sequence[str], what: str) -> list[tuple[int, str]]:
    """Return places and names of the things that an element means.

    Args:
        element: a name, a number counted from 1, or ``*`` for all.
        names: of all the things.
        what: one of them is, for errors.

    Raises:
        InputError: there is no such thing; names those there are.
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
        else f"no {what} {short(element)}: there is none"
    )
