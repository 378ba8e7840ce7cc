"""One decorator for every compiled function, with a disk cache that cannot go stale.

Numba's own cache watches only the file a function stands in, so a change in a function it
calls from another file goes unseen. Here the cache folder's name is a digest of the source of
all three packages: any edit starts a fresh cache, and all processes share what one compiled.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

_PACKAGES = ("space_robot_msgs_py", "space_robot_sim", "space_robot_control")
_OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_njit: Any = numba.njit
config: Any = numba.config
_Function = TypeVar("_Function", bound=Callable[..., Any])


ROOM_BYTES = 16 << 20
"""What a whole cache needs, with room to spare."""


@cache
def cache_directory() -> Path:
    """Folder of the compiled kernels: ``NUMBA_CACHE_DIR`` or the user's cache, by source digest.

    Where that cannot be written, a folder of the user's own among the temporary files.
    """
    root = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256(str(root).encode())  # Numba keeps installations apart, so do we
    for package in _PACKAGES:
        for source in sorted((root / package).rglob("*.py")):
            text = source.read_bytes()
            if b"@kernel" in text or b"@subroutine" in text:
                digest.update(text)
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    base = os.environ.get("NUMBA_CACHE_DIR") or str(Path(home) / "space_robot")
    wanted, name = Path(base), digest.hexdigest()[:16]
    if not (why := _unusable(wanted / name)):
        return wanted / name
    other = _temporary_cache()
    sys.stderr.write(
        f"space_robot: compiled code is kept in {other}: {wanted} cannot be used ({why})\n"
    )
    os.environ["NUMBA_CACHE_DIR"] = str(other)  # the processes that this one starts share it
    return other / name


def _unusable(folder: Path) -> str:
    """Why no cache can be kept there; empty if it can, or if there is one already."""
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
    """A folder that is nobody else's: what is in it is run."""
    folder = Path(tempfile.gettempdir()) / f"space_robot_{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid():
            folder.chmod(0o700)
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="space_robot_"))


def kernel(function: _Function) -> _Function:
    """Compile ``function`` on first call, without the GIL, cached on disk.

    IEEE arithmetic is kept as written (no fast-math): the same inputs give the same bits in
    every process, which is what makes the graph and the in-process flight agree.
    """
    with _our_cache():
        compiled = _njit(cache=True, **_OPTIONS)(function)
    save = compiled._cache.save_overload

    def save_if_there_is_room(*arguments: Any) -> None:
        with suppress(OSError):  # the next process compiles it again
            save(*arguments)

    compiled._cache.save_overload = save_if_there_is_room
    return cast(_Function, compiled)


def subroutine(function: _Function) -> _Function:
    """A small part of kernels, callable from them only: it compiles in half the time."""
    return cast(_Function, _njit(no_cpython_wrapper=True, **_OPTIONS)(function))


@cache
def function_pointer(function: Callable[..., Any], signature: Any) -> Any:
    """A kernel as a value that a compiled loop can be given, as one type for all of them.

    A loop then need not be compiled again for every function it may call.
    """
    compiled: Any = function
    with _our_cache():
        try:
            return numba.cfunc(signature, cache=True, error_model="numpy")(compiled.py_func)
        except OSError:  # no room in the cache
            return numba.cfunc(signature, error_model="numpy")(compiled.py_func)


@contextmanager
def _our_cache() -> Iterator[None]:
    """Numba reads the folder when it decorates."""
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(cache_directory())
    try:
        yield
    finally:
        config.CACHE_DIR = previous
