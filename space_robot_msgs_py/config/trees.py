"""Nested settings and their dotted names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import InputError
from .text import printable

Tree = dict[str, Any]


def merge(below: Tree, above: Mapping[str, Any]) -> Tree:
    """Return ``below`` with its leaves overridden by those of ``above``."""
    merged = dict(below)
    for key, value in above.items():
        old = merged.get(key)
        both = isinstance(old, dict) and isinstance(value, Mapping)
        merged[key] = merge(old, value) if both else value  # type: ignore[arg-type]
    return merged


def nest(flat: Mapping[Any, Any]) -> Tree:
    """Convert ``{"a.b": 1}`` to ``{"a": {"b": 1}}``.

    Raises:
        InputError: a key has a value and also a group of values.
    """
    tree: Tree = {}
    for key, value in flat.items():
        head, _, rest = str(key).partition(".")
        inner = nest({rest: value}) if rest else nest(value) if isinstance(value, dict) else value
        _refuse_both(tree, {head: inner})
        tree = merge(tree, {head: inner})
    return tree


def _refuse_both(one: Tree, other: Tree, prefix: str = "") -> None:
    """Check that no key is a value in one tree and a group of values in the other."""
    for key in one.keys() & other.keys():
        first, second = one[key], other[key]
        if isinstance(first, dict) is not isinstance(second, dict):
            name = printable(f"{prefix}{key}")
            raise InputError(f"{name}: given as a value, and as a group of values")
        if isinstance(first, dict):
            _refuse_both(first, second, f"{prefix}{key}.")


def flatten(tree: Mapping[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield ``("a.b", 1)`` for each leaf of ``{"a": {"b": 1}}``; an empty mapping is a leaf."""
    for key, value in tree.items():
        if isinstance(value, Mapping) and value:
            yield from flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
