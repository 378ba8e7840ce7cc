"""Kernels needed by a kernel, and the number of compiled ones, for a progress bar."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from types import CodeType
from typing import Any


def index_files(functions: Iterable[Any]) -> set[str]:
    """Return the index file of each of some kernels and of the kernels that they call.

    Numba writes the file when the kernel is compiled. Subroutines have no file: they are compiled
    into their callers.
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


def count_compiled(files: Iterable[str], since_ns: int = 0) -> int:
    """Return the number of `index_files` that have been written since a time, ns."""
    return sum(_written_ns(file) > since_ns for file in files)


def _written_ns(file: str) -> int:
    try:
        return os.stat(file).st_mtime_ns
    except OSError:
        return 0


def _called(function: Any) -> Iterator[Any]:
    """Yield the kernels and subroutines that a function refers to."""
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
