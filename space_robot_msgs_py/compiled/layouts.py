"""Where the fields of a record stand, as a formula of the number of joints n.

The layout of one n is NumPy's to keep (`Record.dtype`). Compiled code is given the formula, and n
at run time, so that a robot of another size needs no other code. Each dimension of an array is
``a + b n``; so sizes and offsets are polynomials of n.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

DEGREE = 2
"""Highest power of n in the size of a field: that of a matrix."""


class Dimension(NamedTuple):
    """``constant + slope n`` elements."""

    constant: int
    slope: int


class Polynomial(NamedTuple):
    """``a + b n + c n^2``, float64 numbers that stand one behind the other."""

    a: int = 0
    b: int = 0
    c: int = 0

    def plus(self, other: Polynomial) -> Polynomial:
        """Return the sum."""
        return Polynomial(self.a + other.a, self.b + other.b, self.c + other.c)

    def times(self, dimension: Dimension) -> Polynomial:
        """Return the product.

        Raises:
            TypeError: n stands in it to a power beyond `DEGREE`.
        """
        constant, slope = dimension
        if self.c * slope:
            raise TypeError(f"a field's size may grow with n to the power of {DEGREE} at most")
        b, c = self.b * constant + self.a * slope, self.c * constant + self.b * slope
        return Polynomial(self.a * constant, b, c)


@dataclass(frozen=True)
class Layout:
    """The fields of a record by name, in their order in memory.

    Records with equal fields have equal layouts: a compiled function takes all of them.
    """

    fields: tuple[tuple[str, tuple[Dimension, ...] | Layout], ...]
    """The dimensions of an array, () of a number; or the layout of a record within the record."""

    @property
    def size(self) -> Polynomial:
        """Numbers in the whole record."""
        return _end_of(self.fields)

    def find(self, name: str) -> tuple[Polynomial, tuple[Dimension, ...] | Layout] | None:
        """Return where a field stands, in numbers from the beginning, and what it is."""
        for k, (known, kind) in enumerate(self.fields):
            if known == name:
                return _end_of(self.fields[:k]), kind
        return None


def _end_of(fields: tuple[tuple[str, tuple[Dimension, ...] | Layout], ...]) -> Polynomial:
    total = Polynomial()
    for _, kind in fields:
        total = total.plus(kind.size if isinstance(kind, Layout) else count(kind))
    return total


def count(dimensions: tuple[Dimension, ...]) -> Polynomial:
    """Return the number of elements of an array."""
    total = Polynomial(1)
    for dimension in dimensions:
        total = total.times(dimension)
    return total


def dimensions_of(name: str, shape: Callable[[int], tuple[int, ...]]) -> tuple[Dimension, ...]:
    """Read the formula of a shape off its values.

    Raises:
        TypeError: a dimension is not ``a + b n``.
    """
    dimensions = tuple(
        Dimension(at_0, at_1 - at_0) for at_0, at_1 in zip(shape(0), shape(1), strict=True)
    )
    for n in (2, 7):
        if tuple(constant + slope * n for constant, slope in dimensions) != shape(n):
            raise TypeError(f"the shape of field {name!r} must be linear in n")
    return dimensions
