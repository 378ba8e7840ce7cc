"""Named arrays in one block of memory, whose sizes a kernel knows when it is compiled.

A kernel that takes a `Record` gets one pointer instead of a dozen arrays to check and unpack,
and its loops over links and axes have constant bounds. NumPy and Numba both read the fields by
attribute, so the same declaration serves Python and compiled code.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

Shape = Callable[[int], tuple[int, ...]]


def shaped(shape: Shape) -> Any:
    """A field of float64: its shape for a robot of n joints."""
    return shape


def nested(record: type[Record]) -> Any:
    """A field that is another record."""
    return record


class Record:
    """Base of all declarations; the class itself is never instantiated.

    ``allocate`` gives the record (for Python, and for kernels called now and then), ``block``
    the array of one record that kernels on the hot path take: Numba accepts it ten times faster.
    """

    @classmethod
    def dtype(cls, n: int) -> np.dtype[Any]:
        """Memory layout for a robot of ``n`` joints."""
        record: Any = cls
        return _dtype(record, n)

    @classmethod
    def block(cls, n: int) -> NDArray[Any]:
        """An array of one record of zeros; ``block[0]`` is the record."""
        return np.zeros(1, cls.dtype(n))

    @classmethod
    def allocate(cls, n: int) -> Self:
        """A record of zeros for a robot of ``n`` joints."""
        return cast(Self, cls.block(n)[0])


def assign(record: Record, **values: Any) -> None:
    """Copy arrays or records into fields of ``record``."""
    for name, value in values.items():
        cast(Any, record)[name] = value


@lru_cache(maxsize=256)
def _dtype(record: Any, n: int) -> np.dtype[Any]:
    fields: list[Any] = []
    for name, value in vars(record).items():
        if isinstance(value, type) and issubclass(value, Record):
            fields.append((name, value.dtype(n)))
        elif name in record.__annotations__:
            fields.append((name, np.float64, value(n)))
    return np.dtype((np.record, np.dtype(fields, align=True)))
