"""The kernels that a kernel needs, and how many of them are compiled: for a progress bar."""

from __future__ import annotations

import os.path
from collections.abc import Iterable, Iterator
from types import CodeType
from typing import Any


def index_files(functions: Iterable[Any]) -> set[str]:
    """Return the file of each kernel that some kernels need, themselves included.

    Numba writes the file once the kernel is compiled. Subroutines have none: they are compiled
    into the kernels that call them.
    """
    files: set[str] = set()
    seen: set[int] = set()
    waiting = list(functions)
    while waiting:
        function = waiting.pop()
        if id(function) in seen:
            continue
        seen.add(id(function))
        if path := getattr(getattr(function._cache, "_cache_file", None), "_index_path", None):
            files.add(path)
        waiting += _called(function.py_func)
    return files


def count_compiled(files: Iterable[str]) -> int:
    """Return how many of the `index_files` are there."""
    return sum(map(os.path.exists, files))


def _called(function: Any) -> Iterator[Any]:
    """Yield the kernels and subroutines that a function names."""
    for name in _names(function.__code__):
        value = function.__globals__.get(name)
        if hasattr(value, "py_func"):
            yield value
    for cell in function.__closure__ or ():
        if hasattr(cell.cell_contents, "py_func"):
            yield cell.cell_contents


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)
