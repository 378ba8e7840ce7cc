"""Blocks of a long flight, so that metrics need constant memory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .flight_log import FlightLog

Array = NDArray[np.float64]

BLOCK_TICKS = 60_000
"""Rows of a block but the last: 30 s at 2 kHz, the paper's whole mission."""


class Metric(ABC):
    """Metric of a flight, computed block by block.

    The same blocks give the same bits, and blocks cut elsewhere the same numbers but for rounding:
    what spans two blocks (a difference, a delay) is taken across their border.
    """

    @abstractmethod
    def add(self, log: FlightLog, error: Array) -> None:
        """Take the next rows of the flight, whole ones, and their tracking error (N, m)."""

    @abstractmethod
    def result(self) -> Any:
        """Return the metric of all rows so far, ready for JSON.

        Raises:
            InputError: the flight does not have this metric.
        """


def block_bounds(ticks: int) -> Iterator[tuple[int, int]]:
    """Yield the first row and the row after the last of each block of a flight of ``ticks``."""
    for start in range(0, ticks, BLOCK_TICKS):
        yield start, min(start + BLOCK_TICKS, ticks)


def blocks_of(log: FlightLog) -> Iterator[FlightLog]:
    """Yield the blocks of a log that is in memory as a whole, as views, from its first row on."""
    for start, stop in block_bounds(log.ticks):
        yield log.rows(start, stop)


def last_rows(log: FlightLog, count: int) -> FlightLog:
    """Copy the last ``count`` rows, or all if there are fewer."""
    rows = log.rows(max(0, log.ticks - count), log.ticks)
    columns: dict[str, Any] = {name: column.copy() for name, column in rows.columns.items()}
    if rows.measured is not None:
        columns["measured"] = rows.measured.each(lambda _, column: column.copy())
    return replace(rows, **columns)


def joined(before: FlightLog | None, log: FlightLog) -> FlightLog:
    """Prepend the rows of ``before`` to ``log``; without rows, return ``log``."""
    if before is None:
        return log
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(before, name), column])
        for name, column in log.columns.items()
    }
    if log.measured is not None and before.measured is not None:
        measured = before.measured.columns
        columns["measured"] = log.measured.each(
            lambda name, column: np.concatenate([measured[name], column])
        )
    return replace(log, **columns, first_tick=before.first_tick)
