"""Paths into a tree of settings, such as ``robot.links[*].mass``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError

EACH = "*"
_STEP = r"([^.\[\]]+)(?:\[([^\[\]]+)\])?"
_PATH = re.compile(rf"{_STEP}(?:\.{_STEP})*")
_STEPS = re.compile(_STEP)

Path = tuple[str, ...]
"""Keys from the root of a tree to one leaf."""


class Unavailable(str):
    """In place of a leaf that cannot be varied: the reason, or the path to use instead."""


class Elements(dict[str, Any]):
    """The elements of a list by name; in paths their names stand in brackets."""

    def __init__(
        self, elements: Mapping[str, Any], aliases: Sequence[str] = (), default: str = ""
    ) -> None:
        """Store the elements.

        Args:
            elements: by name.
            aliases: a further name of each, in the same order.
            default: what a path without brackets selects: "each", "all" with one number,
                or, if empty, nothing.
        """
        super().__init__(elements)
        self.aliases, self.default = dict(zip(aliases, elements, strict=False)), default

    def chosen(self, element: str, where: str) -> list[str]:
        """Return the names of the elements selected by name, number from 1, or ``*``."""
        names = list(self)
        if element == EACH:
            return names
        if element in names:
            return [element]
        if element in self.aliases:
            return [self.aliases[element]]
        if element.isdecimal() and 1 <= int(element) <= len(names):
            return [names[int(element) - 1]]
        advice = choices(element, names, f", 1 to {len(names)}, or *") if names else "it is empty"
        raise InputError(f"{where} has no element {short(element)}: {advice}")


def value_at(tree: Tree, path: Path) -> Any:
    """Return what is at a path; None if nothing is."""
    value: Any = tree
    for key in path:
        value = value.get(key) if isinstance(value, dict) else None
    return value


def matches(tree: Tree, pattern: str) -> dict[str, list[Path]]:
    """Return the leaves that a pattern selects.

    Args:
        tree: of settings.
        pattern: words joined by dots, elements of lists in brackets.

    Returns:
        By the name of each independent number the leaves that get it, in the tree's order.
    """
    if not _PATH.fullmatch(pattern):
        raise InputError(f"{short(pattern)} is not a path such as robot.links[*].mass")
    selected: dict[str, list[Path]] = {"": [()]}
    for word, element in _STEPS.findall(pattern):
        selected = _step(tree, selected, word, element)
    for name, paths in selected.items():
        if isinstance(value := value_at(tree, paths[0]), dict):
            raise InputError(f"{name} is a group: choose one of {', '.join(value) or 'none'} in it")
    return selected


def _step(
    tree: Tree, selected: Mapping[str, list[Path]], word: str, element: str
) -> dict[str, list[Path]]:
    inner: dict[str, list[Path]] = {}
    refusals = []
    for name, paths in selected.items():
        try:
            inner |= _inner(tree, name, paths, word, element)
        except InputError as error:
            refusals.append(error)
    if refusals and not inner:
        raise refusals[0]
    return inner


def _inner(
    tree: Tree, name: str, paths: list[Path], word: str, element: str
) -> dict[str, list[Path]]:
    node = value_at(tree, paths[0])
    if not isinstance(node, dict):
        raise InputError(f"{name} has nothing in it to vary")
    if isinstance(inner := node.get(word), Unavailable):
        raise InputError(inner)
    allowed = [key for key, value in node.items() if not isinstance(value, Unavailable)]
    one_of(word, allowed, "name" if name else "group", f" in {name}" if name else "")
    name, paths = f"{name}.{word}" if name else word, [(*path, word) for path in paths]
    if not isinstance(inner, Elements):
        if element:
            raise InputError(f"{name} has no elements")
        return {name: paths}
    if not element and inner.default == "all":
        return {name: [(*path, own) for path in paths for own in inner]}
    if not element and not inner.default:
        raise InputError(f"an element is missing: {name}[*] for each of {', '.join(inner)}")
    return {
        f"{name}[{own}]": [(*path, own) for path in paths]
        for own in inner.chosen(element or EACH, name)
    }


def replaced(tree: Tree, values: Mapping[Path, Any]) -> Tree:
    """Return the branches of a tree in which leaves are replaced; lists are complete."""
    changed: Tree = {}
    for path, value in values.items():
        node, original = changed, tree
        for key in path[:-1]:
            original = original.get(key, {}) if isinstance(original, dict) else {}
            if key not in node:
                node[key] = Elements(original) if isinstance(original, Elements) else {}
            node = node[key]
        node[path[-1]] = value
    return changed


def plain(tree: Any) -> Any:
    """Return a tree with lists in place of their elements by name."""
    if isinstance(tree, Elements):
        return [plain(value) for value in tree.values()]
    return {key: plain(value) for key, value in tree.items()} if isinstance(tree, dict) else tree


def numbered(tree: Any) -> Any:
    """Return a tree with the elements of lists by their numbers from 1."""
    if isinstance(tree, dict):
        return {key: numbered(value) for key, value in tree.items()}
    if isinstance(tree, list):
        return Elements({str(number): numbered(value) for number, value in enumerate(tree, 1)})
    return tree
