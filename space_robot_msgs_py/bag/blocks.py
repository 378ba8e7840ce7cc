"""Long flights in parts: figures of merit are summed up block by block, in flat memory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .flight_log import FlightLog

Array = NDArray[np.float64]

BLOCK_TICKS = 60_000
"""Rows of a block but the last: 30 s at 2 kHz, the paper's whole mission."""


class Figure(ABC):
    """A figure of merit that is summed up block by block.

    The same blocks give the same bits, and blocks cut elsewhere the same figure but for rounding:
    what spans two blocks (a difference, a delay) is taken across their border.
    """

    @abstractmethod
    def add(self, log: FlightLog, error: Array) -> None:
        """Take the next rows of the flight, whole ones, and their tracking error (N, m)."""

    @abstractmethod
    def result(self) -> Any:
        """The figure of all rows so far, ready for JSON.

        Raises:
            InputError: this flight does not have it.
        """


def block_bounds(ticks: int) -> Iterator[tuple[int, int]]:
    """First row and the row after the last of every block of a flight of ``ticks``."""
    for start in range(0, ticks, BLOCK_TICKS):
        yield start, min(start + BLOCK_TICKS, ticks)


def blocks_of(log: FlightLog) -> Iterator[FlightLog]:
    """The blocks of a log that is in memory as a whole, counted from its first row; views."""
    for start, stop in block_bounds(log.ticks):
        yield log.rows(start, stop)


def last_rows(log: FlightLog, count: int) -> FlightLog:
    """A copy of the last ``count`` rows, or of all if there are fewer."""
    rows = log.rows(max(0, log.ticks - count), log.ticks)
    columns: dict[str, Any] = {name: c.copy() for name, c in _columns(rows).items()}
    return replace(rows, **columns)


def joined(before: FlightLog | None, log: FlightLog) -> FlightLog:
    """``log`` with the rows of ``before`` in front; ``log`` itself if there are none."""
    if before is None:
        return log
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(before, name), column])
        for name, column in _columns(log).items()
    }
    return replace(log, **columns, first_tick=before.first_tick)


def _columns(log: FlightLog) -> dict[str, Any]:
    values = {f.name: getattr(log, f.name) for f in fields(log)}
    return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
