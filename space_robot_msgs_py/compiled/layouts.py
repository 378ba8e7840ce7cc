"""Memory layout of a record as a function of the number of joints n.

For a particular n the layout is a NumPy dtype (`Record.dtype`). Compiled code uses the formula with
n at run time, so that it works for robots of any size. Each dimension of an array is ``a + b n``,
so sizes and offsets are polynomials of n.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

DEGREE = 2
"""Highest power of n in the size of a field, as in a matrix."""


class Dimension(NamedTuple):
    """``constant + slope n`` elements."""

    constant: int
    slope: int


class Polynomial(NamedTuple):
    """``a + b n + c n^2``, a number of consecutive float64."""

    a: int = 0
    b: int = 0
    c: int = 0

    def plus(self, other: Polynomial) -> Polynomial:
        """Return the sum."""
        return Polynomial(self.a + other.a, self.b + other.b, self.c + other.c)

    def times(self, dimension: Dimension) -> Polynomial:
        """Return the product.

        Raises:
            TypeError: the power of n exceeds `DEGREE`.
        """
        constant, slope = dimension
        if self.c * slope:
            raise TypeError(f"a field's size may grow with n to the power of {DEGREE} at most")
        b, c = self.b * constant + self.a * slope, self.c * constant + self.b * slope
        return Polynomial(self.a * constant, b, c)


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
        return _end_of(self.fields)

    def find(self, name: str) -> tuple[Polynomial, tuple[Dimension, ...] | Layout] | None:
        """Return offset, in numbers, and shape or layout of a field; None if it does not exist."""
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
    """Derive the formula of a shape from its values.

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
