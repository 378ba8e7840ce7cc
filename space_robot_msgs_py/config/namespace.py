"""ROS namespaces: the first part of a full name, such as /sat1 of /sat1/plant_node."""

from __future__ import annotations

import re

from ..errors import InputError
from ..topics import ROOT
from .validation import short

_NAMESPACE = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_TWO = "__"
"""A character that ROS names cannot contain."""


def full_namespace(text: str) -> str:
    """Return a namespace in ROS's form: ``/sat1`` for ``sat1`` or ``/sat1/``, ``/`` if empty.

    Raises:
        InputError: invalid namespace.
    """
    if not (name := text.strip("/")):
        return ROOT
    namespace = f"/{name}"
    if not _NAMESPACE.fullmatch(namespace) or _TWO in namespace:
        raise InputError(
            f"{short(text)} is not a namespace: letters, digits and _ were expected, not starting "
            "with a digit, such as sat1 or fleet/sat1"
        )
    return namespace


def relative(name: str, namespace: str) -> str:
    """Return a name relative to a namespace; empty if it is in another or a nested one."""
    prefix, _, last = name.rpartition("/")
    return last if (prefix or ROOT) == namespace else ""
