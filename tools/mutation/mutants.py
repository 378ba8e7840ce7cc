"""Small changes of a module that a test should notice: Cosmic Ray's operators, and one more."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

from areas import ROOT
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

Place = tuple[tuple[int, int], tuple[int, int]]

NOT_USED = re.compile(
    # what Python or Numba mostly refuse by type, so that any test would notice
    r"BinaryOperator_\w+_(BitAnd|BitOr|BitXor|LShift|RShift)$|BinaryOperator_\w+_Pow$"
    r"|_Is$|_IsNot$|_Mod$|_FloorDiv$"
    # a kernel that is not compiled gives the same numbers
    r"|RemoveDecorator|ExceptionReplacer"
)


@cache
def text_of(module: Path) -> str:
    """A module as it was when first asked for: the tree may change while trials go on."""
    return (ROOT / module).read_text("utf-8")


class Mutant(NamedTuple):
    """One change of one module."""

    module: Path
    operator: str
    occurrence: int
    line: int

    def text(self) -> str:
        """The module with the change."""
        source = text_of(self.module)
        if self.operator == DELETE:
            return _without(source, self.occurrence)
        changed = mutate_code(source, get_operator(self.operator)(), self.occurrence)
        if changed is None:
            raise LookupError(f"{self} does not exist")
        return str(changed)


DELETE = "statement deleted"


def _deletable(tree: ast.AST) -> list[ast.stmt]:
    """Statements that do something to what exists: without a name they bind, nothing else fails."""
    return [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.AugAssign)
        or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call))
        or (
            isinstance(node, ast.Assign)
            and all(isinstance(t, ast.Subscript | ast.Attribute) for t in node.targets)
        )
    ]


def _without(source: str, occurrence: int) -> str:
    node = _deletable(ast.parse(source))[occurrence]
    lines = source.splitlines(keepends=True)
    first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
    head = lines[first].encode()[: node.col_offset].decode()
    tail = lines[last].encode()[node.end_col_offset :].decode()
    return "".join([*lines[:first], head + "pass" + tail, *lines[last + 1 :]])


def _unused_ranges(tree: ast.AST) -> Iterator[Place]:
    """What no test can notice: annotations, `slots=True`, texts, lines of a script or a checker."""
    for node in ast.walk(tree):
        parts: list[Any] = []
        if isinstance(node, ast.FunctionDef):
            parts = [node.returns]
        elif isinstance(node, ast.ClassDef):
            parts = list(node.decorator_list)
        elif isinstance(node, ast.arg | ast.AnnAssign):
            parts = [node.annotation]
        elif isinstance(node, ast.JoinedStr) or _is_for_tools(node):
            parts = [node]
        for part in parts:
            if part is not None:
                yield (part.lineno, part.col_offset), (part.end_lineno, part.end_col_offset)


def _is_for_tools(node: ast.AST) -> bool:
    """Return True for ``if TYPE_CHECKING`` and ``if __name__ == "__main__"``."""
    if not isinstance(node, ast.If):
        return False
    names = {part.id for part in ast.walk(node.test) if isinstance(part, ast.Name)}
    return bool(names & {"TYPE_CHECKING", "__name__"})


@cache
def mutants(module: Path) -> dict[int, list[Mutant]]:
    """All mutants of a module, by the line they change."""
    source = text_of(module)
    tree, parsed = get_ast(source), ast.parse(source)
    unused = list(_unused_ranges(parsed))
    found: dict[int, list[Mutant]] = defaultdict(list)
    for name in operator_names():
        operator = get_operator(name)
        if NOT_USED.search(name) or operator.arguments():
            continue
        places = (
            place for node in ast_nodes(tree) for place in operator().mutation_positions(node)
        )
        for occurrence, (start, stop) in enumerate(places):
            if not any(first <= start and stop <= last for first, last in unused):
                found[start[0]].append(Mutant(module, name, occurrence, start[0]))
    for occurrence, node in enumerate(_deletable(parsed)):
        start, stop = (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)
        if not any(first <= start and stop <= last for first, last in unused):
            found[node.lineno].append(Mutant(module, DELETE, occurrence, node.lineno))
    return dict(found)


def sample(modules: list[Path], count: int, random: Random) -> list[Mutant]:
    """Mutants of ``count`` different lines, drawn from all lines alike, each the line's by lot."""
    lines = [found for module in modules for found in mutants(module).values()]
    return [random.choice(found) for found in random.sample(lines, min(count, len(lines)))]
