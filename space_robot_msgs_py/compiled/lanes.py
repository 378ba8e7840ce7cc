"""Words of kernels that are compiled for one flight and for eight in lanes.

In lanes a number is eight numbers wide, one for each of eight flights. Arithmetic and comparisons
act lane by lane. A comparison gives a mask, which cannot be the condition of an ``if``: a kernel
says `where` for a choice of values, and `uniform`, `whole`, `any_lane` or `all_lanes` for a branch
of all lanes together. For plain numbers these functions do what they do for one lane.
"""

from __future__ import annotations

from typing import Any

WIDTH = 8
"""Number of lanes."""


def where(condition: Any, then: Any, otherwise: Any) -> Any:
    """Return ``then if condition else otherwise``, lane by lane; both have been computed."""
    return then if condition else otherwise


def uniform(value: Any) -> Any:
    """Return a value that is the same in all lanes, as a plain float or bool."""
    return value


def whole(value: Any) -> int:
    """Return the integer in a number that is the same in all lanes."""
    return int(value)


def any_lane(condition: Any) -> bool:
    """Return whether a condition is true in any lane."""
    return bool(condition)


def all_lanes(condition: Any) -> bool:
    """Return whether a condition is true in all lanes."""
    return bool(condition)


def negated(condition: Any) -> Any:
    """Return ``not condition``, lane by lane."""
    return not condition


def lane_of(value: Any, lane: int) -> Any:
    """Return the value of one lane as a plain number."""
    return value


def with_lane(value: Any, lane: int, number: float) -> Any:
    """Return ``value`` with another number in one lane."""
    return number
