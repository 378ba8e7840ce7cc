"""Local names of a function: how often they get a value, and where C declares them."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import cache

from .language import RefusedError

RESERVED = re.compile(
    "auto|case|char|const|default|do|double|enum|extern|goto|inline|long|register|restrict|short|"
    "signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile"
)
INDENT = "    "
MARK = "§"
"""Stands around a local name where it gets a value."""


def names_in(nodes: Iterable[ast.AST], stored: bool = False) -> Counter[str]:
    """Return how often names are mentioned; ``stored``: how often they get a value."""
    counted: Counter[str] = Counter()
    for node in nodes:
        counted.update(_names_in(node, stored))
    return counted


@cache
def _names_in(node: ast.AST, stored: bool) -> Counter[str]:
    names = (n for n in ast.walk(node) if isinstance(n, ast.Name))
    return Counter(n.id for n in names if not stored or isinstance(n.ctx, ast.Store))


@cache
def assigned_in(tree: ast.FunctionDef) -> Counter[str]:
    """Return how often names get a value in a function.

    Raises:
        RefusedError: what a loop counts is mentioned outside of it, where it differs in C.
    """
    inside: Counter[str] = Counter()
    for loop in (n for n in ast.walk(tree) if isinstance(n, ast.For)):
        for name in names_in([loop.target]):
            if name in names_in(loop.body, stored=True):
                raise RefusedError(f"{name!r} set beside its loop", "use another name")
            inside[name] += names_in([loop])[name]
    mentioned = names_in([tree])
    for name in filter(RESERVED.fullmatch, mentioned):
        raise RefusedError(f"the name {name!r}", "C has it: use another one")
    for name, count in inside.items():
        if mentioned[name] != count and name != "_":
            raise RefusedError(f"{name!r} outside of its loop", "use another name")
    return names_in([tree], stored=True)


def declared(lines: Sequence[str], declarations: Mapping[str, str]) -> list[str]:
    """Return lines in which each name is declared in the innermost block that has it.

    Args:
        lines: of a function, indented, with a `MARK` around a name that gets a value.
        declarations: of each local name.
    """
    done = list(lines)
    for name, declaration in declarations.items():
        value = f"{MARK}{name}{MARK} = "
        mention = re.compile(rf"(?<![\w.>:]){name}\b")
        places = [k for k, line in enumerate(done) if mention.search(line)]
        for place in reversed(places):  # what nobody reads
            _, is_value, source = done[place].partition(value)
            if len(places) == 1 and is_value and "(" not in source:
                del done[place]
                places = []
        if not places:
            continue
        first, level = places[0], _level(done[places[0]])
        while not _is_in_block(done, first, level, places[-1]):
            level -= 1
            first = _beginning(done, first, level)
        is_in_loop = any(_is_loop_around(done, k, first) for k in range(first))
        if first == places[0] and done[first].strip().startswith(value):
            done[first] = done[first].replace(value, f"{declaration} = ")
        else:
            place, level = (0, 1) if is_in_loop else (first, level)
            done.insert(place, f"{INDENT * level}{declaration};")
    return [line.replace(MARK, "") for line in done]


def _level(line: str) -> int:
    return (len(line) - len(line.lstrip())) // len(INDENT)


def _is_in_block(lines: Sequence[str], first: int, level: int, last: int) -> bool:
    """Return whether the block of a level at ``first`` reaches to ``last``."""
    return all(_level(line) >= level for line in lines[first : last + 1])


def _beginning(lines: Sequence[str], place: int, level: int) -> int:
    """Return where the statement of a level begins that has the line at ``place``."""
    while _level(lines[place]) > level or lines[place].strip().startswith("}"):
        place -= 1
    return place


def _is_loop_around(lines: Sequence[str], head: int, place: int) -> bool:
    """Return whether the line ``head`` begins a loop around the line at ``place``."""
    level, is_loop = _level(lines[head]), lines[head].strip().startswith(("for (", "while ("))
    return is_loop and all(_level(line) > level for line in lines[head + 1 : place + 1])
