"""Compiled code on disk: its folder, whose name is a digest of the sources, and what is in it."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from types import CodeType
from typing import Any

ROOM_BYTES = 16 << 20
"""Required free space for a complete cache, with reserve."""
_NAME = re.compile(rb"\b[A-Z][A-Z0-9_]+\b")
_IMPORT = re.compile(rb"^from (\.*)([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)
_CONSTANT = re.compile(rb"\n([A-Z][A-Z0-9_, ]+) = (.*)")


@cache
def cache_directory() -> Path:
    """Return the folder of compiled kernels: ``NUMBA_CACHE_DIR`` or the user's cache, by digest.

    If it cannot be written, a private folder among the temporary files is used.
    """
    here = Path(__file__).resolve()
    root = here.parents[2]
    digest = hashlib.sha256(str(root).encode())  # one cache per installation, as in Numba
    texts = {source: source.read_bytes() for source in sorted(root.glob("space_robot*/**/*.py"))}
    kernels = [
        source
        for source, text in texts.items()
        if b"@kernel" in text or b"@subroutine" in text or source.parent == here.parent
    ]
    for source in kernels:
        digest.update(texts[source])
    for constant in _imported_constants(kernels, texts, root):  # they are compiled into kernels
        digest.update(constant)
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    base = os.environ.get("NUMBA_CACHE_DIR") or str(Path(home) / "space_robot")
    wanted, name = Path(base), digest.hexdigest()[:16]
    if not (why := _unusable(wanted / name)):
        return wanted / name
    other = _temporary_cache()
    sys.stderr.write(
        f"space_robot: compiled code is stored in {other}: {wanted} cannot be used ({why})\n"
    )
    os.environ["NUMBA_CACHE_DIR"] = str(other)  # for child processes
    return other / name


def _imported_constants(
    kernels: Iterable[Path], texts: Mapping[Path, bytes], root: Path
) -> list[bytes]:
    """Return the definitions of the constants that modules import, and of those in them."""
    definitions: set[bytes] = set()
    waiting = [(source, frozenset[bytes]()) for source in kernels]
    seen = set(waiting)
    while waiting:
        source, asked = waiting.pop()
        names = set(asked)
        for constants, values in _CONSTANT.findall(texts[source]):
            if not asked.isdisjoint(_NAME.findall(constants)):
                definitions.add(constants + values)
                names.update(_NAME.findall(values))
        needed = [(source, frozenset(names))] if asked else []
        needed += [
            (module, frozenset(imported & names if asked else imported))
            for module, imported in _imports(source, texts, root)
        ]
        new = [each for each in needed if each[1] and each not in seen]
        seen.update(new)
        waiting += new
    return sorted(definitions)


def _imports(
    source: Path, texts: Mapping[Path, bytes], root: Path
) -> Iterator[tuple[Path, set[bytes]]]:
    """Yield the modules from which a module imports constants, and the names of these."""
    for dots, name, imported in _IMPORT.findall(texts[source].partition(b"\n\n\n")[0]):
        if names := set(_NAME.findall(imported)):
            start = source.parents[len(dots) - 1] if dots else root
            place = start.joinpath(*filter(None, name.decode().split(".")))
            if (module := place.with_suffix(".py")) in texts:
                yield module, names
            else:  # a package's names are of any of its modules
                yield from ((inner, names) for inner in texts if inner.parent == place)


def _unusable(folder: Path) -> str:
    try:
        is_new = not folder.is_dir()
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        if is_new and shutil.disk_usage(folder).free < ROOM_BYTES:
            folder.rmdir()
            return "no space left"
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _temporary_cache() -> Path:
    # of this user only: code in it is executed
    folder = Path(tempfile.gettempdir()) / f"space_robot_{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid():
            folder.chmod(0o700)
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="space_robot_"))


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
