"""Compiled kernels of a copy of the tree, of which a mutant has those that it cannot have changed.

Run as a script in a copy, it prints the sources of each kernel: of all functions compiled into it,
and the modules from which these import what is no function.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
import pkgutil
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from areas import PACKAGES, ROOT

COMPILER = "compiled"
"""Folder of what all kernels are compiled with."""
Sources = dict[str, list[str]]
"""Modules (relative to the root) compiled into a kernel, by its files' ``room_hash/name``."""


def subfolder(folder: Path) -> str:
    """Return Numba's name for the kernels of the modules of a folder."""
    return f"{folder.name}_{hashlib.sha1(str(folder).encode()).hexdigest()}"


def seed(kernels: Path, tree: Path, known: Path) -> None:
    """Fill the cache of a copy in ``tree`` with what is compiled here, which is in ``known``."""
    for mark in known.glob("*.*"):  # what has been compiled as a whole
        shutil.copy2(mark, kernels)
    files = (file for package in PACKAGES.values() for file in tree.glob(f"{package}/**/*.py"))
    for folder in {file.parent for file in files}:
        origin = known / subfolder(ROOT / folder.relative_to(tree))
        if origin.is_dir():
            shutil.copytree(origin, kernels / subfolder(folder), dirs_exist_ok=True)


def reuse(known: Path, kernels: Path, sources: Sources, module: Path) -> None:
    """Fill a mutant's cache with the kernels that do not contain its module."""
    if module.parent.name == COMPILER:
        return
    for file in known.glob("*/*"):
        name = f"{file.parent.name}/{file.name.split('.py3')[0]}"
        if name in sources and str(module) not in sources[name]:
            (kernels / file.parent.name).mkdir(exist_ok=True)
            (kernels / file.parent.name / file.name).hardlink_to(file)


def _modules() -> Iterator[ModuleType]:
    for package in PACKAGES.values():
        for found in pkgutil.walk_packages([package], f"{package}."):
            if not found.name.endswith("__main__"):
                try:
                    yield importlib.import_module(found.name)
                except ImportError:  # a library that is missing
                    continue


def _compiled_into(kernel: Any) -> Iterator[Any]:
    """Yield a kernel and what is compiled into it."""
    waiting, seen = [kernel], set()
    while waiting:
        function = waiting.pop()
        if id(function) not in seen:
            seen.add(id(function))
            yield function
            code = function.py_func
            values = [code.__globals__.get(name) for name in _names(code.__code__)]
            values += [cell.cell_contents for cell in code.__closure__ or ()]
            waiting += [value for value in values if hasattr(value, "py_func")]


def _names(code: Any) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if hasattr(constant, "co_names"):
            yield from _names(constant)


def _origins(file: Path) -> set[Path]:
    """Return the modules that a module imports from; all of a folder for its package's names."""
    package = ".".join(file.relative_to(Path.cwd()).parent.parts)
    origins: set[Path] = set()
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom):
            name = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            where = Path(getattr(sys.modules.get(name), "__file__", None) or "")
            is_package = where.name == "__init__.py" and where.is_relative_to(Path.cwd())
            origins.update(where.parent.glob("*.py") if is_package else [where])
    return origins


def main() -> None:
    """Print the sources of each kernel, as JSON."""
    here, sources = Path.cwd(), Sources()
    sys.path.insert(0, str(here))
    for module in list(_modules()):
        for kernel in vars(module).values():
            cache = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
            if cache and hasattr(kernel, "py_func"):
                files = {Path(f.py_func.__code__.co_filename) for f in _compiled_into(kernel)}
                files |= {origin for file in files for origin in _origins(file)}
                index = Path(cache._index_path)
                sources[f"{index.parent.name}/{index.name.split('.py3')[0]}"] = sorted(
                    str(file.relative_to(here)) for file in files if file.is_relative_to(here)
                )
    print(json.dumps(sources))


if __name__ == "__main__":
    main()
