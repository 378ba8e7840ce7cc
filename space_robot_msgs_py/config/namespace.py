"""Namespaces of ROS: the part of a full name before its last ones, as /sat1 of /sat1/plant_node."""

from __future__ import annotations

import re

from ..errors import InputError
from ..topics import ROOT
from .validation import short

_NAMESPACE = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_TWO = "__"
"""Nowhere in a name of ROS."""


def full_namespace(text: str) -> str:
    """``sat1``, ``/sat1`` or ``/sat1/`` as ROS has it, ``/sat1``; empty is the root, ``/``.

    Raises:
        InputError: it cannot be one.
    """
    if not (name := text.strip("/")):
        return ROOT
    namespace = f"/{name}"
    if not _NAMESPACE.fullmatch(namespace) or _TWO in namespace:
        raise InputError(
            f"{short(text)} is no namespace: letters, digits and _ were expected, no digit first, "
            "as sat1 or fleet/sat1"
        )
    return namespace


def relative(name: str, namespace: str) -> str:
    """The name relative to a namespace; empty if it is in another one, or in one further down."""
    prefix, _, last = name.rpartition("/")
    return last if (prefix or ROOT) == namespace else ""
