"""Long flights in parts: figures of merit are summed up block by block, in flat memory."""

from __future__ import annotations

from collections.abc import Iterator

from space_robot_msgs_py.flight_log import FlightLog

BLOCK_TICKS = 60_000
"""Rows of a block but the last: 30 s at 2 kHz, the paper's whole mission."""


def block_bounds(ticks: int) -> Iterator[tuple[int, int]]:
    """First row and the row after the last of every block of a flight of ``ticks``."""
    for start in range(0, ticks, BLOCK_TICKS):
        yield start, min(start + BLOCK_TICKS, ticks)


def blocks_of(log: FlightLog) -> Iterator[FlightLog]:
    """The blocks of a log that is in memory as a whole, counted from its first row; views."""
    for start, stop in block_bounds(log.ticks):
        yield log.rows(start, stop)
