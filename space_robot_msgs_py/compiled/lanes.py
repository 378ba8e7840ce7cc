"""Words of kernels that are compiled for one flight and for eight in lanes.

In lanes a number is eight numbers wide, one for each of eight flights. Arithmetic and comparisons
act lane by lane. A comparison gives a mask, which cannot be the condition of an ``if``: a kernel
says `where` for a choice of values, and `uniform`, `whole`, `any_lane` or `all_lanes` for a branch
of all lanes together. For plain numbers these functions do what they do for one lane.
"""

from __future__ import annotations

from typing import Any, TypeVar

_Value = TypeVar("_Value")
WIDTH = 8
"""Number of lanes."""


def where(condition: bool, then: _Value, otherwise: _Value) -> _Value:
    """Return ``then if condition else otherwise``, lane by lane; both have been computed.

    The values are numbers, conditions, or tuples of numbers.
    """
    return then if condition else otherwise


def uniform(value: _Value) -> _Value:
    """Return a value that is the same in all lanes, as a plain float or bool."""
    return value


def whole(value: float) -> int:
    """Return the integer in a number that is the same in all lanes."""
    return int(value)


def any_lane(condition: bool) -> bool:
    """Return whether a condition is true in any lane."""
    return bool(condition)


def all_lanes(condition: bool) -> bool:
    """Return whether a condition is true in all lanes."""
    return bool(condition)


def negated(condition: bool) -> bool:
    """Return ``not condition``, lane by lane."""
    return not condition


def lane_of(value: _Value, lane: int) -> _Value:
    """Return the value of one lane as a plain number."""
    return value


def with_lane(value: float, lane: int, number: float) -> float:
    """Return ``value`` with another number in one lane."""
    return number


def as_lanes(array: Any) -> Any:
    """Return a contiguous array (..., 8) of floats as an array (...) of lanes, in kernels."""
    raise TypeError("only kernels see an array as lanes")


def as_numbers(array: Any) -> Any:
    """Return an array (...) of lanes as one of floats (..., 8), one of floats as (..., 1)."""
    raise TypeError("only kernels see an array as numbers")
