"""One decorator for every compiled function, with a disk cache that cannot go stale.

Numba's own cache watches only the file a function stands in, so a change in a function it
calls from another file goes unseen. Here the cache folder's name is a digest of the source of
all three packages: any edit starts a fresh cache, and all processes share what one compiled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any, TypeVar, cast

import numba

from .cache import cache_directory

_OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_njit: Any = numba.njit
config: Any = numba.config
_Function = TypeVar("_Function", bound=Callable[..., Any])


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
