"""Where a function's local names live: in C each is declared in the innermost block that has it."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable, Sequence

Path = tuple[tuple[int, int], ...]
"""Of a statement: number of the block and place in it, from the outermost block inwards."""


class Homes:
    """The blocks in which the local names of a function are declared."""

    def __init__(self, tree: ast.FunctionDef) -> None:
        """Find them in a function's syntax tree."""
        self._parameters = {argument.arg for argument in tree.args.args}
        self._loops: set[int] = set()
        self._paths: dict[str, list[tuple[Path, ast.stmt]]] = {}
        self._of_loops: dict[str, bool] = {}
        self._blocks = 0
        self.assignments: Counter[str] = Counter()
        """Number of assignments to each name."""
        self._visit(tree.body, (), frozenset())
        self.names = {*self._paths, *self._parameters}
        self._first: dict[int, list[str]] = {}
        self._begins: dict[str, ast.stmt] = {}
        for name in self._paths:
            if name not in self._parameters and not self._of_loops.get(name):
                self._settle(name, tree)

    def beginning(self, statement: ast.stmt) -> list[str]:
        """Return the names whose home's first mention is in a statement of that block."""
        return self._first.get(id(statement), [])

    def is_assigned_first(self, name: str, statement: ast.stmt) -> bool:
        """Return whether a name can be declared with its first value, by this statement."""
        return name in _targets(statement) and name not in _reads(statement)

    def is_declared_here(self, name: str, statement: ast.stmt) -> bool:
        """Return whether an assignment is the declaration of a name."""
        return self._begins.get(name) is statement and self.is_assigned_first(name, statement)

    def is_parameter(self, name: str) -> bool:
        """Return whether a name is an argument of the function."""
        return name in self._parameters

    def is_only_of_loops(self, name: str) -> bool:
        """Return whether a name is mentioned only inside loops that it counts."""
        return self._of_loops.get(name, False)

    def _visit(self, block: Sequence[ast.stmt], path: Path, counters: frozenset[str]) -> None:
        number = self._blocks
        self._blocks += 1
        for k, statement in enumerate(block):
            here = (*path, (number, k))
            inner = counters
            if isinstance(statement, ast.For):
                inner = counters | names_in([statement.target])
                self._mention(names_in([statement.iter]), here, statement, counters)
                self._mention(names_in([statement.target]), here, statement, inner)
            elif isinstance(statement, (ast.If, ast.While)):
                self._mention(names_in([statement.test]), here, statement, counters)
            else:
                self._mention(names_in([statement]), here, statement, counters)
            self.assignments.update(_targets(statement))
            for part in ("body", "orelse"):
                inside = getattr(statement, part, [])
                if inside:
                    if isinstance(statement, (ast.For, ast.While)):
                        self._loops.add(self._blocks)
                    self._visit(inside, here, inner)

    def _mention(
        self, names: Iterable[str], path: Path, statement: ast.stmt, counters: frozenset[str]
    ) -> None:
        for name in names:
            self._paths.setdefault(name, []).append((path, statement))
            self._of_loops[name] = self._of_loops.get(name, True) and name in counters

    def _settle(self, name: str, tree: ast.FunctionDef) -> None:
        paths = [path for path, _ in self._paths[name]]
        depth = 0
        while all(len(p) > depth + 1 for p in paths) and len({p[depth] for p in paths}) == 1:
            depth += 1
        while True:
            block = paths[0][depth][0]
            place = min(path[depth][1] for path in paths)
            statement = _at(tree, (*paths[0][:depth], (block, place)))
            is_first = self.is_assigned_first(name, statement)
            in_loop = any(number in self._loops for number, _ in paths[0][: depth + 1])
            if is_first or not in_loop or depth == 0:
                break
            depth -= 1
        self._begins[name] = statement
        self._first.setdefault(id(statement), []).append(name)


def _at(tree: ast.FunctionDef, path: Path) -> ast.stmt:
    """Return the statement of a path."""
    blocks = _numbered(tree.body)
    number, place = path[-1]
    return blocks[number][place]


def _numbered(body: Sequence[ast.stmt]) -> list[Sequence[ast.stmt]]:
    blocks = [body]
    for statement in body:
        for part in ("body", "orelse"):
            inside = getattr(statement, part, [])
            if inside:
                blocks += _numbered(inside)
    return blocks


def names_in(nodes: Iterable[ast.AST]) -> set[str]:
    """Return all names mentioned."""
    return {n.id for node in nodes for n in ast.walk(node) if isinstance(n, ast.Name)}


def assigned_names(statements: Iterable[ast.stmt]) -> set[str]:
    """Return the names that statements assign to, those in them included."""
    names: set[str] = set()
    for statement in statements:
        for node in ast.walk(statement):
            names |= _targets(node)
    return names


def _targets(node: ast.AST) -> set[str]:
    if isinstance(node, ast.Assign):
        targets = node.targets
    elif isinstance(node, (ast.AnnAssign, ast.AugAssign, ast.For)):
        targets = [node.target]
    else:
        return set()
    flat = [t for target in targets for t in _flat(target)]
    return {target.id for target in flat if isinstance(target, ast.Name)}


def _flat(target: ast.expr) -> list[ast.expr]:
    if isinstance(target, ast.Tuple):
        return [part for element in target.elts for part in _flat(element)]
    return [target]


def _reads(statement: ast.stmt) -> set[str]:
    if isinstance(statement, ast.AugAssign):
        return names_in([statement])
    value = getattr(statement, "value", None)
    read = names_in([value]) if value is not None else set()
    if isinstance(statement, ast.Assign):
        for target in (t for target in statement.targets for t in _flat(target)):
            if not isinstance(target, ast.Name):
                read |= names_in([target])
    return read
