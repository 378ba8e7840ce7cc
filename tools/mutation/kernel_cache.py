"""Compiled kernels of a copy of the tree, of which a mutant has those that it cannot have changed.

As a script it prints the sources of each kernel: of all functions compiled into it, and the modules
from which these import what is no function.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
import pkgutil
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from areas import PACKAGES, ROOT

COMPILER = "compiled"
"""Folder of what all kernels are compiled with."""


@cache
def sources() -> dict[str, list[str]]:
    """Return the modules compiled into each kernel, by its folder and the name of its files."""
    output = subprocess.check_output([sys.executable, __file__], cwd=ROOT)
    return dict(json.loads(output))


@cache
def folders() -> list[Path]:
    """Return the folders with modules, relative to the root."""
    files = (file for package in PACKAGES.values() for file in ROOT.glob(f"{package}/**/*.py"))
    return sorted({file.parent.relative_to(ROOT) for file in files})


def subfolder(folder: Path) -> str:
    """Return Numba's name for the kernels of the modules of a folder."""
    return f"{folder.name}_{hashlib.sha1(str(folder).encode()).hexdigest()}"


def seed(kernels: Path, tree: Path, known: Path) -> None:
    """Fill the cache of a copy in ``tree`` with what is compiled here, which is in ``known``."""
    for mark in known.glob("*.*"):  # what has been compiled as a whole
        shutil.copy2(mark, kernels)
    for folder in folders():
        if (origin := known / subfolder(ROOT / folder)).is_dir():
            shutil.copytree(origin, kernels / subfolder(tree / folder), dirs_exist_ok=True)


def reuse(known: Path, tree: Path, kernels: Path, module: Path) -> None:
    """Fill a mutant's cache with the kernels of a copy that do not contain its module."""
    for folder in folders() if module.parent.name != COMPILER else ():
        name = subfolder(tree / folder)
        for file in (known / name).glob("*"):
            kernel = f"{folder}/{file.name.split('.py3')[0]}"
            if str(module) not in sources().get(kernel, [str(module)]):
                (kernels / name).mkdir(exist_ok=True)
                (kernels / name / file.name).hardlink_to(file)


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
    here, kernels = Path.cwd(), dict[str, list[str]]()
    sys.path.insert(0, str(here))
    for module in list(_modules()):
        for kernel in vars(module).values():
            store = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
            if store and hasattr(kernel, "py_func"):
                files = {Path(f.py_func.__code__.co_filename) for f in _compiled_into(kernel)}
                files |= {origin for file in files for origin in _origins(file)}
                folder = Path(kernel.py_func.__code__.co_filename).parent
                if folder.is_relative_to(here):
                    stem = Path(store._index_path).name.split(".py3")[0]
                    kernels[f"{folder.relative_to(here)}/{stem}"] = sorted(
                        str(file.relative_to(here)) for file in files if file.is_relative_to(here)
                    )
    print(json.dumps(kernels))


if __name__ == "__main__":
    main()
