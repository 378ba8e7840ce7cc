"""Named arrays in one block of memory, whose sizes a kernel knows when it is compiled.

A kernel that takes a `Record` gets one pointer instead of a dozen arrays to check and unpack,
and its loops over links and axes have constant bounds. NumPy and Numba both read the fields by
attribute, so the same declaration serves Python and compiled code.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

Block = NDArray[Any]
"""An array (1,) of one record; Numba takes it ten times faster than the record."""
Shape = Callable[[int], tuple[int, ...]]


@dataclass(frozen=True)
class Field:
    """A field of float64."""

    shape: Shape
    """Its shape for a robot of n joints."""
    description: str
    """Meaning and unit, where somebody outside the code is to read them."""


def shaped(shape: Shape, description: str = "") -> Any:
    """Declare a `Field`."""
    return Field(shape, description)


def nested(record: type[Record]) -> Any:
    """Declare a field that is another record."""
    return record


class Record:
    """Base of all declarations; the class itself is never instantiated.

    A subclass has the fields of its base first, so code that knows the base alone can read
    those of any subclass's block (`prefix`).
    """

    address: int
    """The place in memory of a `view`'s block."""

    @classmethod
    def fields(cls) -> dict[str, Field | type[Record]]:
        """The fields by name, in their order in memory."""
        found: dict[str, Field | type[Record]] = {}
        for base in reversed(cls.__mro__):
            for name, value in vars(base).items():
                if isinstance(value, Field) or (
                    isinstance(value, type) and issubclass(value, Record)
                ):
                    found[name] = value
        return found

    @classmethod
    def dtype(cls, n: int) -> np.dtype[Any]:
        """Memory layout for a robot of ``n`` joints."""
        record: Any = cls
        return _dtype(record, n)

    @classmethod
    def block(cls, n: int) -> Block:
        """A block of zeros; ``block[0]`` is the record."""
        return np.zeros(1, cls.dtype(n))

    @classmethod
    def allocate(cls, n: int) -> Self:
        """A record of zeros for a robot of ``n`` joints."""
        return cast(Self, cls.block(n)[0])

    @classmethod
    def view(cls, block: Block) -> Self:
        """The arrays of a block as attributes, which Python reads ten times faster than a record's.

        They are written in place (``view.name[:] = ...``); fields without a shape are left out.
        """
        found = SimpleNamespace(address=block.ctypes.data)
        for name, field in cls.fields().items():
            if not isinstance(field, Field):
                setattr(found, name, field.view(block[name]))
            elif block[name].ndim > 1:
                setattr(found, name, block[name][0])
        return cast(Self, found)


def prefix(block: Block, base: np.dtype[Any]) -> Block:
    """A block's first bytes as a block of another layout: that of its record's base."""
    return np.ndarray((1,), base, buffer=block)


def assign(record: Record, **values: Any) -> None:
    """Copy arrays or records into fields of ``record``."""
    for name, value in values.items():
        cast(Any, record)[name] = value


@lru_cache(maxsize=256)
def _dtype(record: Any, n: int) -> np.dtype[Any]:
    fields: list[Any] = []
    for name, value in record.fields().items():
        if isinstance(value, Field):
            fields.append((name, np.float64, value.shape(n)))
        else:
            fields.append((name, value.dtype(n)))
    return np.dtype((np.record, np.dtype(fields, align=True)))
