"""One decorator for every compiled function, with a disk cache that cannot go stale.

Numba's own cache watches only the file a function stands in, so a change in a function it
calls from another file goes unseen. Here the cache folder's name is a digest of the files of all
three packages that have kernels: an edit of one of them starts a fresh cache, an edit of another
file does not, and all processes share what one compiled.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.errors import NumbaError
from numba.core.runtime.nrt import rtsys
from numba.experimental import function_type  # noqa: F401  (what Numba makes of a RecordFunction)

from ..errors import InputError
from . import block_type  # noqa: F401  (what Numba makes of a block)
from .cache import cache_directory
from .record_type import RecordType
from .records import Record

_OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_njit: Any = numba.njit
config: Any = numba.config
_FunctionType: Any = numba.types.WrapperAddressProtocol
_Function = TypeVar("_Function", bound=Callable[..., Any])
_CFunc: Any = CFunc
_FunctionCache: Any = FunctionCache
_COLOURS = re.compile(r"\x1b\[\d*m")
"""Of a terminal, which Numba puts into its errors."""


def kernel(function: _Function) -> _Function:
    """Compile ``function`` on first call, without the GIL, cached on disk.

    IEEE arithmetic is kept as written (no fast-math, nothing fused): the same inputs give the same
    bits in every process and on every processor, if they call no function of the C library (sine,
    exponential, ...) but the square root.
    """
    compiled = _njit(**_OPTIONS)(function)
    with _our_cache():
        compiled._cache = _KernelCache(function)
    return cast(_Function, compiled)


def subroutine(function: _Function) -> _Function:
    """A small part of kernels, callable from them only: it compiles in half the time."""
    return cast(_Function, _njit(no_cpython_wrapper=True, **_OPTIONS)(function))


class _KernelCache(_FunctionCache):  # type: ignore[misc]
    """Numba's cache of a function (0.58 to 0.68), for machine code as it is.

    Numba's own loads the whole compiler and SciPy's linear algebra first, which takes longer than
    all else; a function that is not in the cache has them loaded when it is compiled.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load a compiled function; None if it is not in the cache."""
        rtsys.initialize(target_context)  # what machine code calls
        return self._load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a compiled function if there is room; else the next process compiles it again."""
        with suppress(OSError):
            super().save_overload(sig, data)


class _Callback(_CFunc):  # type: ignore[misc]
    """A function to be called by its address, with the same cache."""

    def enable_caching(self) -> None:
        with _our_cache():
            self._cache = _KernelCache(self._pyfunc)


class RecordFunction(_FunctionType):  # type: ignore[misc]
    """A kernel of records, and a float at last, as a value that a compiled loop can be given.

    A loop sees it as a function of the records that all such kernels share the beginning of, and is
    compiled once for all of them: a record is passed by its address and its number of joints, and
    what lies there is the kernel's affair alone.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        records: Iterable[type[Record]],
        seen_as: Iterable[type[Record]],
    ) -> None:
        """Compile a kernel.

        Args:
            function: the kernel.
            records: of its arguments.
            seen_as: those that a loop passes in their place.

        Raises:
            InputError: it cannot be compiled; with the reason and the line in one line.
        """
        compiled: Any = function
        own, self._signature = _signature(records), _signature(seen_as)
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
        """Run it from Python, on the records at these addresses, each followed by its n."""

    def __wrapper_address__(self) -> int:
        """Address of the machine code, for Numba."""
        return self._address

    def signature(self) -> Any:
        """The type that a loop sees, for Numba."""
        return self._signature


def _reason(error: NumbaError) -> str:
    """Return the line of Numba's many that says what is wrong, and where that is."""
    lines = [line.strip() for line in _COLOURS.sub("", str(error)).splitlines()]
    reasons = [line for line in lines if line and not line.startswith(("Failed in", "File "))]
    place = re.search(r'File "(.+?)", (line \d+)', "\n".join(lines))
    where = f" ({place[1]}, {place[2]})" if place else ""
    return f"{reasons[0] if reasons else type(error).__name__}{where}"


def _signature(records: Iterable[type[Record]]) -> Any:
    return numba.void(*(RecordType(record.layout()) for record in records), numba.float64)


@contextmanager
def _our_cache() -> Iterator[None]:
    """Numba reads the folder when it decorates."""
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(cache_directory())
    try:
        yield
    finally:
        config.CACHE_DIR = previous
