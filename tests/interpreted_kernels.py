"""A plugin of pytest that runs kernels as plain Python, so that coverage sees their lines.

    python -m pytest -p interpreted_kernels tests/sim/dynamics

Compiled code runs past every tracer. Here the decorators hand the functions back as they are,
before any module uses them; so it is a hundred times slower, and for short tests only.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from space_robot_msgs_py.compiled import kernels


def _as_it_is(function: Any, *_: Any) -> Any:
    return function


def _field_first(self: np.record, name: str) -> Any:
    """As in compiled code: a field's name counts before those of NumPy (``data``)."""
    fields = np.void.__getattribute__(self, "dtype").fields or {}
    return self[name] if name in fields else np.void.__getattribute__(self, name)


class _RecordFunction:
    """A `RecordFunction` that reads what lies at the addresses of its records."""

    def __init__(
        self, function: Callable[..., None], layouts: Sequence[np.dtype[Any]], _: object
    ) -> None:
        self._function, self._layouts = function, layouts

    def __call__(self, *arguments: Any) -> None:
        *records, last = arguments
        self.call(*(record.__array_interface__["data"][0] for record in records), last)

    def call(self, *arguments: Any) -> None:
        *addresses, last = arguments
        places = zip(self._layouts, addresses, strict=True)
        records = [
            np.frombuffer((ctypes.c_char * layout.itemsize).from_address(address), layout)[0]
            for layout, address in places
        ]
        self._function(*records, last)


class _PlainFunction:
    """As `RecordFunction`: called with records, or with their addresses."""

    def __init__(self, function: Any, layouts: Iterable[np.dtype[Any]], _: Any) -> None:
        self._function, self._layouts = function, tuple(layouts)

    def call(self, *arguments: Any) -> None:
        *addresses, period = arguments
        self._function(*map(_record_at, addresses, self._layouts), period)

    def __call__(self, *arguments: Any) -> None:
        *records, period = arguments
        self.call(*(record.__array_interface__["data"][0] for record in records), period)


def _record_at(address: int, layout: np.dtype[Any]) -> Any:
    memory = (ctypes.c_char * layout.itemsize).from_address(address)
    return np.ndarray((1,), layout, buffer=memory)[0]


kernels.kernel = kernels.subroutine = _as_it_is  # type: ignore[assignment]
kernels.RecordFunction = _PlainFunction  # type: ignore[assignment,misc]
np.record.__getattribute__ = _field_first  # type: ignore[method-assign]
