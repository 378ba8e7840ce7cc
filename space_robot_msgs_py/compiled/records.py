"""Named arrays in one block of memory, for Python and compiled code.

A kernel receives a `Record` as a pointer and the number of joints, instead of a dozen arrays to
check and unpack. NumPy and Numba both read the fields as attributes, from the same declaration:
NumPy uses the layout for one n (`Record.dtype`). Compiled code uses a formula with n at run time,
so that it works for robots of any size: each dimension of an array is ``a + b n``, so sizes and
offsets are polynomials of n.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import cache, lru_cache
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from .lanes import WIDTH

Block = NDArray[Any]
"""An array (1,) of one record; Numba unboxes it ten times faster than the record."""
Shape = Callable[[int], tuple[int, ...]]
Source = str | Callable[[Any, Any], Any]
"""Path of an attribute, or a function of what there is to fill a record from."""
DEGREE = 2
"""Highest power of n in the size of a field, as in a matrix."""
MOST_KEPT = 1024


class Dimension(NamedTuple):
    """``constant + slope n`` elements."""

    constant: int
    slope: int


class Polynomial(NamedTuple):
    """``a + b n + c n^2``, a number of consecutive float64."""

    a: int = 0
    b: int = 0
    c: int = 0


@dataclass(frozen=True)
class Layout:
    """Fields of a record by name, in memory order.

    Records with equal fields have equal layouts, so a compiled function accepts all of them.
    """

    fields: tuple[tuple[str, tuple[Dimension, ...] | Layout], ...]
    """Dimensions of an array, () for a number, or the layout of a nested record."""

    @property
    def size(self) -> Polynomial:
        """Number of float64 in the record."""
        return _size_of(self.fields)

    def find(self, name: str) -> tuple[Polynomial, tuple[Dimension, ...] | Layout] | None:
        """Return offset, in numbers, and shape or layout of a field; None if it does not exist."""
        for k, (known, kind) in enumerate(self.fields):
            if known == name:
                return _size_of(self.fields[:k]), kind
        return None


def _size_of(fields: tuple[tuple[str, tuple[Dimension, ...] | Layout], ...]) -> Polynomial:
    # three values of n determine a polynomial of the second degree
    at_0, at_1, at_2 = (sum(_count(kind, n) for _, kind in fields) for n in range(DEGREE + 1))
    c = (at_2 - 2 * at_1 + at_0) // 2
    return Polynomial(at_0, at_1 - at_0 - c, c)


def _count(kind: tuple[Dimension, ...] | Layout, n: int) -> int:
    if isinstance(kind, Layout):
        return sum(_count(inner, n) for _, inner in kind.fields)
    return math.prod(constant + slope * n for constant, slope in kind)


def dimensions_of(name: str, shape: Callable[[int], tuple[int, ...]]) -> tuple[Dimension, ...]:
    """Derive the formula of a shape from its values."""
    dimensions = tuple(
        Dimension(at_0, at_1 - at_0) for at_0, at_1 in zip(shape(0), shape(1), strict=True)
    )
    for n in (2, 7):
        if tuple(constant + slope * n for constant, slope in dimensions) != shape(n):
            raise TypeError(f"the shape of field {name!r} must be linear in n")
    if sum(slope != 0 for _, slope in dimensions) > DEGREE:
        raise TypeError(f"field {name!r} may grow with n to the power of {DEGREE} at most")
    return dimensions


@dataclass(frozen=True)
class Field:
    """Declaration of a float64 field."""

    shape: Shape
    """Shape for a robot with n joints."""
    description: str
    """Meaning and unit, for users."""
    uniform: bool = False
    """True if kernels need the same numbers in all lanes, see `lanes`."""
    _: KW_ONLY
    source: Source | None = None
    """Where its first numbers are from, for those who fill the record; None: it begins at zero."""


def shaped(
    shape: Shape, description: str = "", *, uniform: bool = False, source: Source | None = None
) -> Any:
    """Declare a `Field`."""
    return Field(shape, description, uniform, source=source)


def nested(record: type[Record]) -> Any:
    """Declare a field that is another record."""
    return record


class Record:
    """Base class of all declarations; never instantiated.

    The fields of the base class come first, so code for the base class can read the block of any
    subclass (`prefix`).
    """

    address: int
    """Memory address of a `view`'s block."""
    view_type: ClassVar[type[RecordView]]
    """Class of its `view`."""

    @classmethod
    @cache
    def fields(cls) -> dict[str, Field | type[Record]]:
        """Return the fields by name, in memory order."""
        return {
            name: value
            for base in reversed(cls.__mro__)
            for name, value in vars(base).items()
            if isinstance(value, Field) or (isinstance(value, type) and issubclass(value, Record))
        }

    @classmethod
    @cache
    def layout(cls) -> Layout:
        """Return the memory layout for any number of joints."""
        return Layout(
            tuple(
                (name, dimensions_of(name, v.shape) if isinstance(v, Field) else v.layout())
                for name, v in cls.fields().items()
            )
        )

    @classmethod
    @lru_cache(maxsize=512)
    def dtype(cls, n: int, width: int = 1) -> np.dtype[Any]:
        """Return the memory layout for a robot with ``n`` joints, of numbers of a width."""
        fields: list[Any] = []
        lanes = (width,) if width > 1 else ()
        for name, value in cls.fields().items():
            if isinstance(value, Field):
                fields.append((name, np.float64, value.shape(n) + lanes))
            else:
                fields.append((name, value.dtype(n, width)))
        dtype = np.dtype((np.record, np.dtype(fields, align=True)))
        known = cls.layout(), width
        if _LAYOUTS.setdefault(dtype, known) != known:
            raise TypeError(f"{cls.__name__} cannot be told from another record of equal names")
        return dtype

    @classmethod
    def block(cls, n: int) -> Block:
        """Return a block of zeros; ``block[0]`` is the record."""
        return np.zeros(1, cls.dtype(n))

    @classmethod
    def lanes(cls, n: int) -> Block:
        """Return a block of zeros in lanes: each number of the record is (8,) numbers.

        It begins at a multiple of a vector's size, for the processor's sake.
        """
        dtype = cls.dtype(n, WIDTH)
        room = np.zeros(dtype.itemsize // 8 + WIDTH)
        start = -room.ctypes.data // 8 % WIDTH
        return np.ndarray((1,), dtype, buffer=room, offset=8 * start)

    @classmethod
    def uniform_numbers(cls, block: Block) -> bytes:
        """Return the numbers of a block (1,) that must be the same in all lanes."""
        numbers: NDArray[np.float64] = block.view(np.float64)
        return numbers[cls._uniform_places(block.dtype)].tobytes()

    @classmethod
    @lru_cache(maxsize=256)
    def _uniform_places(cls, dtype: np.dtype[Any]) -> NDArray[np.intp]:
        places: list[NDArray[np.intp]] = [np.empty(0, np.intp)]
        for name, value in cls.fields().items():
            assert dtype.fields is not None
            kind, offset = dtype.fields[name][:2]
            if not isinstance(value, Field):
                places.append(offset // 8 + value._uniform_places(kind))
            elif value.uniform:
                places.append(offset // 8 + np.arange(kind.itemsize // 8))
        return np.concatenate(places)

    @classmethod
    def allocate(cls, n: int) -> Self:
        """Return a record of zeros for a robot with ``n`` joints."""
        return cast(Self, cls.block(n)[0])

    @classmethod
    def view(cls, block: Block) -> Self:
        """Return the arrays of a block as attributes, ten times faster in Python than a record.

        They are written in place (``view.name[:] = ...``); scalar fields are floats, which are
        written by assignment.
        """
        record = cls.view_type(address=block.ctypes.data)
        scalars: dict[str, NDArray[np.float64]] = {}
        for name, field in cls.fields().items():
            if not isinstance(field, Field):
                setattr(record, name, field.view(block[name]))
            elif block[name].ndim > 1:
                setattr(record, name, block[name][0])
            else:
                scalars[name] = block[name]
        record.scalars = scalars
        return cast(Self, record)


class RecordView(SimpleNamespace):
    """Result of `Record.view`. It has a memory address, so it cannot be copied or pickled.

    Copy the object that owns the block instead: a `RecordOwner` creates its views again.
    """

    scalars: dict[str, NDArray[np.float64]]
    """Scalar fields by name, (1,) each."""

    def __getattr__(self, name: str) -> float:
        """Return the number of a scalar field."""
        scalars = vars(self).get("scalars", {})
        if name not in scalars:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return float(scalars[name][0])

    def __setattr__(self, name: str, value: Any) -> None:
        """Write the number of a scalar field, or set an attribute that is no field."""
        scalars = vars(self).get("scalars", {})
        if name in scalars:
            scalars[name][0] = value
        else:
            super().__setattr__(name, value)

    def __reduce__(self) -> Any:
        """Refuse copying and pickling."""
        raise TypeError(
            "a view of a record cannot be copied or pickled: copy the object that owns its block "
            "(a law, a controller, a plant, a bench), and omit views in its __getstate__"
        )


Record.view_type = RecordView


class RecordOwner:
    """Base class of owners of record blocks with views of them as attributes.

    A copy by `copy` or `pickle` has its own blocks, and views of these; NumPy alone would copy
    blocks and views separately, without connection.
    """

    _views: ClassVar[tuple[str, ...]]
    """Names of the attributes that `_bind_views` sets."""

    def _bind_views(self) -> None:
        """Set the attributes that are views of the blocks."""
        raise NotImplementedError

    def __getstate__(self) -> dict[str, Any]:
        """Return all attributes except the views."""
        state = {name: value for name, value in vars(self).items() if name not in self._views}
        arrays = {name: value for name, value in state.items() if isinstance(value, np.ndarray)}
        blocks = [array for array in arrays.values() if array.dtype.names]
        for name, array in arrays.items():
            if any(array is not block and np.may_share_memory(array, block) for block in blocks):
                raise TypeError(
                    f"{type(self).__name__}.{name} is a view of a record, so the object cannot be "
                    "copied or pickled: read the record where the numbers are needed"
                )
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Set the attributes, and create the views of the blocks."""
        vars(self).update(state)
        self._bind_views()

    def __copy__(self) -> Self:
        """Return a deep copy: a block has one owner."""
        return copy.deepcopy(self)


def prefix(block: Block, base: np.dtype[Any]) -> Block:
    """Return a view of a block as a block of its record's base class."""
    return np.ndarray((1,), base, buffer=block)


def assign(record: Record, **values: Any) -> None:
    """Copy arrays or records into fields of ``record``."""
    for name, value in values.items():
        cast(Any, record)[name] = value


_LAYOUTS: dict[np.dtype[Any], tuple[Layout, int]] = {}
_LAYOUTS_BY_ID: dict[int, tuple[np.dtype[Any], tuple[Layout, int]]] = {}
"""Results of `layout_of` by the identity of the dtype: its hash takes longer than a tick."""


def layout_of(dtype: np.dtype[Any]) -> tuple[Layout, int] | None:
    """Return the layout of a record's dtype, and the width of its numbers.

    None if it is not that of a record.
    """
    kept = _LAYOUTS_BY_ID.get(id(dtype))
    if kept is not None and kept[0] is dtype:
        return kept[1]
    known = _LAYOUTS.get(dtype)
    if known is not None:
        if len(_LAYOUTS_BY_ID) >= MOST_KEPT:
            _LAYOUTS_BY_ID.clear()
        _LAYOUTS_BY_ID[id(dtype)] = dtype, known
    return known
