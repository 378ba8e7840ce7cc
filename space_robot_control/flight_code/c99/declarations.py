"""Local names of a function: how often they get a value, and where C declares them."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from .language import RefusedError

INDENT = "    "
MARK = "\N{SECTION SIGN}"
"""Stands around a local name where it gets a value."""


def names_in(nodes: Iterable[ast.AST]) -> set[str]:
    """Return all names mentioned."""
    return {n.id for node in nodes for n in ast.walk(node) if isinstance(n, ast.Name)}


def assignments(nodes: Iterable[ast.AST]) -> Counter[str]:
    """Return how often names get a value, by loops, too."""
    stores = (n for node in nodes for n in ast.walk(node) if isinstance(n, ast.Name))
    return Counter(n.id for n in stores if isinstance(n.ctx, ast.Store))


def check_counters(tree: ast.FunctionDef) -> None:
    """Check that what loops count is only mentioned in them, since it differs behind them in C.

    Raises:
        RefusedError: a counter is.
    """
    loops = [n for n in ast.walk(tree) if isinstance(n, ast.For)]
    inside: Counter[str] = Counter()
    for loop in loops:
        for name in names_in([loop.target]):
            outer = [o for o in loops if o is not loop and name in names_in([o.target])]
            if any(n is loop for o in outer for n in ast.walk(o)):
                raise RefusedError(f"{name!r} in a loop of its own name", "use another name")
            if name in assignments(loop.body):
                raise RefusedError(f"{name!r} set beside its loop", "use another name")
            inside[name] += _mentions(loop, name)
    for name, count in inside.items():
        if _mentions(tree, name) != count and name != "_":
            raise RefusedError(f"{name!r} outside of its loop", "use another name")


def _mentions(node: ast.AST, name: str) -> int:
    return sum(isinstance(n, ast.Name) and n.id == name for n in ast.walk(node))


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
