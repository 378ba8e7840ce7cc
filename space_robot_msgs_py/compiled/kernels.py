"""Decorators of compiled functions, with a disk cache that is never outdated.

Numba's cache checks only the file of a function, and does not detect changes of called functions in
other files. Here the name of the cache folder is a digest of all files with kernels, and of the
constants that they use: an edit of one of them starts a new cache, other edits do not. All
processes share the cache.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar, cast
from weakref import WeakKeyDictionary

import numba
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.errors import NumbaError
from numba.core.runtime.nrt import rtsys
from numba.core.typing.typeof import typeof_impl
from numba.experimental import function_type  # noqa: F401  (what Numba makes of a RecordFunction)

from ..errors import InputError
from .cache import cache_directory
from .record_type import record_type
from .records import Record

_OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_njit: Any = numba.njit
config: Any = numba.config
_FunctionType: Any = numba.types.WrapperAddressProtocol
_Function = TypeVar("_Function", bound=Callable[..., Any])
_CFunc: Any = CFunc
_FunctionCache: Any = FunctionCache
_COLOURS = re.compile(r"\x1b\[\d*m")
"""Escape sequences of terminals, which Numba's errors contain."""


def kernel(function: _Function) -> _Function:
    """Compile ``function`` on first call, without the GIL, cached on disk.

    IEEE arithmetic is kept as written (no fast-math, no fused operations): the same inputs give the
    same bits in every process and on every processor, except in kernels that call functions of the
    C library other than the square root (sine, exponential, ...).
    """
    compiled = _njit(**_OPTIONS)(function)
    with _our_cache():
        compiled._cache = _KernelCache(function)
    return cast(_Function, compiled)


def subroutine(function: _Function) -> _Function:
    """Compile a small function that only kernels call, in half the time of a kernel."""
    return cast(_Function, _njit(no_cpython_wrapper=True, forceinline=True, **_OPTIONS)(function))


class _KernelCache(_FunctionCache):  # type: ignore[misc]
    """Numba's cache of a function (0.58 to 0.68), for machine code as it is.

    Numba's own loads the whole compiler and SciPy's linear algebra first, which takes longer than
    all else; a function that is not in the cache has them loaded when it is compiled.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load a compiled function; None if it is not in the cache."""
        rtsys.initialize(target_context)  # what machine code calls
        loaded = self._load_overload(sig, target_context)
        if loaded is None:
            from . import assignment, lane_type  # noqa: F401 - what the compiler then knows
        return loaded

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a compiled function if there is room; else the next process compiles it again."""
        with suppress(OSError):
            super().save_overload(sig, data)


class _Callback(_CFunc):  # type: ignore[misc]
    def enable_caching(self) -> None:
        with _our_cache():
            self._cache = _KernelCache(self._pyfunc)


class RecordFunction(_FunctionType):  # type: ignore[misc]
    """A kernel of records, and a float as last argument, as a function value for compiled loops.

    A loop sees it as a function of the common base records of all such kernels, so it is compiled
    only once: a record is passed by its address and number of joints, and only the kernel knows its
    complete layout.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        records: Iterable[type[Record]],
        seen_as: Iterable[type[Record]],
        width: int = 1,
    ) -> None:
        """Compile a kernel.

        Args:
            function: the kernel.
            records: types of its arguments.
            seen_as: types of the arguments as seen by a loop.
            width: of a number in them, see `lanes`.

        Raises:
            InputError: the kernel cannot be compiled; has reason and line number.
        """
        compiled: Any = function
        own, self._signature = _signature(records, width), _signature(seen_as, width)
        whole = own.args, own.return_type
        self._code = _Callback(compiled.py_func, whole, {}, {"error_model": "numpy"})
        self._code.enable_caching()
        try:
            self._code.compile()
        except NumbaError as error:
            name = function.__qualname__
            raise InputError(f"{name} cannot be compiled: {_reason(error)}") from error
        self._address = int(self._code.address or 0)
        arguments = [ctypes.c_void_p, ctypes.c_ssize_t] * (len(own.args) - 1)
        self.call = ctypes.CFUNCTYPE(None, *arguments, ctypes.c_double)(self._address)
        """Call the kernel from Python with the addresses of records, each followed by n."""

    def __wrapper_address__(self) -> int:
        """Return the address of the machine code, for Numba."""
        return self._address

    def signature(self) -> Any:
        """Return the function type as seen by a loop, for Numba."""
        return self._signature


def keep_types(kind: type, key: Callable[[Any], Any]) -> None:
    """Let Numba keep the types of values of a class from one call of a kernel to the next.

    A kernel called from Python asks for the types of its arguments. Numba makes those of functions,
    and of tuples with functions, anew for every call, which takes longer than a law.

    Args:
        kind: the class.
        key: returns the part of a value that its type depends on; the type is kept as long as it.
    """
    of_numba = typeof_impl.dispatch(kind)
    types: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()

    def type_of(value: Any, context: Any) -> Any:
        known = types.get(key(value))
        if known is None:
            known = types[key(value)] = of_numba(value, context)
        return known

    typeof_impl.register(kind, type_of)


keep_types(RecordFunction, lambda function: function)


def _reason(error: NumbaError) -> str:
    lines = [line.strip() for line in _COLOURS.sub("", str(error)).splitlines()]
    reasons = [line for line in lines if line and not line.startswith(("Failed in", "File "))]
    place = re.search(r'File "(.+?)", (line \d+)', "\n".join(lines))
    where = f" ({place[1]}, {place[2]})" if place else ""
    return f"{reasons[0] if reasons else type(error).__name__}{where}"


def _signature(records: Iterable[type[Record]], width: int) -> Any:
    return numba.void(*(record_type(record.layout(), width) for record in records), numba.float64)


@contextmanager
def _our_cache() -> Iterator[None]:
    # Numba reads the setting while it decorates
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(cache_directory())
    try:
        yield
    finally:
        config.CACHE_DIR = previous
