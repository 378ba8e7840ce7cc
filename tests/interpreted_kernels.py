"""A plugin of pytest that runs kernels as plain Python, so that coverage sees their lines.

    python -m pytest -p interpreted_kernels tests/model/dynamics

Compiled code runs past every tracer. Here the decorators hand the functions back as they are,
before any module uses them; so it is a hundred times slower, and for short tests only.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable
from typing import Any

import numpy as np

from space_robot_msgs_py.compiled import kernels, lanes
from space_robot_msgs_py.compiled.records import Record


def _as_it_is(function: Any, *_: Any) -> Any:
    return function


def _field_first(self: np.record, name: str) -> Any:
    """As in compiled code: a field's name counts before those of NumPy (``data``)."""
    fields = np.void.__getattribute__(self, "dtype").fields or {}
    return self[name] if name in fields else np.void.__getattribute__(self, name)


class _PlainFunction:
    """As `RecordFunction`: called with records, or with their addresses, each followed by its n."""

    def __init__(
        self,
        function: Any,
        records: Iterable[type[Record]],
        seen_as: Iterable[type[Record]],
        width: int = 1,
    ) -> None:
        self._function, self._records, self._seen_as = function, tuple(records), tuple(seen_as)

    def call(self, *arguments: Any) -> None:
        *places, last = arguments
        pairs = zip(self._records, places[::2], places[1::2], strict=True)
        found = [_record_at(address, record.dtype(n)) for record, address, n in pairs]
        self._function(*found, last)

    def __call__(self, *arguments: Any) -> None:
        *records, last = arguments
        places: list[int] = []
        for record, kind in zip(records, self._seen_as, strict=True):
            n = next(n for n in range(MOST_JOINTS) if kind.dtype(n) == record.dtype)
            places += (record.__array_interface__["data"][0], n)
        self.call(*places, last)


def _record_at(address: int, layout: np.dtype[Any]) -> Any:
    memory = (ctypes.c_char * layout.itemsize).from_address(address)
    return np.ndarray((1,), layout, buffer=memory)[0]


MOST_JOINTS = 65


def _as_numbers(array: Any) -> Any:
    """As of one flight: a width of 1."""
    return array[..., np.newaxis]


def _as_lanes(array: Any) -> Any:
    """Every number is a lane of its own."""
    return array.reshape(-1)


def _where(condition: Any, then: Any, otherwise: Any) -> Any:
    """Numbers in lanes are arrays (8,) here."""
    if np.ndim(condition) == 0:
        return then if condition else otherwise
    if isinstance(then, tuple):
        return tuple(_where(condition, *pair) for pair in zip(then, otherwise, strict=True))
    return np.where(condition, then, otherwise)


def _first(value: Any) -> Any:
    return value[0] if np.ndim(value) else value


def _lane_of(value: Any, lane: int) -> Any:
    return value[lane] if np.ndim(value) else value


WORDS = {
    "where": _where,
    "uniform": _first,
    "whole": lambda value: int(_first(value)),
    "any_lane": lambda condition: bool(np.any(condition)),
    "all_lanes": lambda condition: bool(np.all(condition)),
    "negated": np.logical_not,
    "lane_of": _lane_of,
}
for name, word in WORDS.items():
    setattr(lanes, name, word)
lanes.as_numbers, lanes.as_lanes = _as_numbers, _as_lanes

kernels.kernel = kernels.subroutine = _as_it_is  # type: ignore[assignment]
kernels.RecordFunction = _PlainFunction  # type: ignore[assignment,misc]
np.record.__getattribute__ = _field_first  # type: ignore[method-assign]
