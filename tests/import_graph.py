"""Who imports whom in the five packages, from the source: no module is run."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from paths import ROOT

PACKAGES = (
    "space_robot_msgs_py",
    "space_robot_model",
    "space_robot_sim",
    "space_robot_control",
    "space_robot",
)
"""From the ground up."""
Graph = Mapping[str, set[str]]


def module_name(file: Path) -> str:
    """``space_robot_sim.plant.loop``; a package's ``__init__.py`` bears the package's name."""
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def modules() -> dict[str, Path]:
    """Every module and its file, relative to the root."""
    files = (file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py")))
    return {module_name(file): file.relative_to(ROOT) for file in files}


@cache
def imports() -> Graph:
    """The modules that each module imports, wherever in it: at the top, in functions, for types."""
    return {
        name: {found for found in _imported(name, file) if found != name}
        for name, file in modules().items()
    }


def _imported(name: str, file: Path) -> Iterator[str]:
    package = name if file.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse((ROOT / file).read_text("utf-8"))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _known(alias.name)
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")
            base = ".".join(parts[: len(parts) - node.level + 1]) if node.level else ""
            origin = ".".join(filter(None, (base, node.module)))
            for alias in node.names:  # a module of that package, or something in it
                yield from _known(f"{origin}.{alias.name}") or _known(origin)


def _known(name: str) -> list[str]:
    return [name] if name in modules() else []


def folders(graph: Graph) -> dict[str, set[str]]:
    """The same between folders; a module in a package's own folder is a room, so as good as one."""
    homes = {
        name: str(file) if len(file.parts) == 2 else str(file.parent)
        for name, file in modules().items()
    }
    found: dict[str, set[str]] = {home: set() for home in homes.values()}
    for importer, imported in graph.items():
        found[homes[importer]] |= {homes[name] for name in imported} - {homes[importer]}
    return found


def circle(graph: Graph) -> list[str]:
    """One of the circles in which nodes lead to one another, each before the one it leads to."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(reversed(error.args[1]))
    return []


def strings(file: Path) -> Iterator[tuple[int, str]]:
    """Texts in the code of a file, with their lines; docstrings are for readers, so left out."""
    tree = ast.parse((ROOT / file).read_text("utf-8"))
    documented = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(text := node.value, str):
            yield from [] if id(node) in documented else [(node.lineno, text)]
