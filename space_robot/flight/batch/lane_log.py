"""Logs of eight flights whose columns are parts of common arrays, for the compiled loop."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.samples import ALL_FIELDS

from ..plan import Flight
from ..simulate import empty_log
from .lane_loop import LaneLog

Array = NDArray[np.float64]


class LogsInLanes:
    """Logs of up to eight flights over the same ticks."""

    def __init__(self, flights: Sequence[Flight], start: int, stop: int) -> None:
        """Allocate logs of the ticks ``start`` to ``stop``."""
        columns: list[Array] = []

        def first(shape: tuple[int, ...]) -> Array:
            column = np.empty((WIDTH, *shape))
            columns.append(column)
            of_first: Array = column[0]
            return of_first

        self.logs = [empty_log(flights[0], start, stop, first)]
        """One of each flight."""
        for lane, flight in enumerate(flights[1:], 1):
            own = iter([column[lane] for column in columns])
            self.logs.append(empty_log(flight, start, stop, partial(_next, own)))
        by_address = {column.ctypes.data: column for column in columns if column.size}
        log = self.logs[0]

        def common(column: Array | None) -> Array:
            if column is None or not column.size:
                return np.empty((WIDTH, 0 if column is None else len(column), 0))
            return by_address[column.ctypes.data]

        measured = {} if log.measured is None else log.measured.columns
        self.lanes = LaneLog(
            tuple(common(getattr(log, name)) for name in ALL_FIELDS),
            tuple(common(measured.get(name)) for name in ALL_FIELDS),
            common(log.commanded_torque),
            common(log.actuator_commands),
            _with_axes(common(log.telemetry)),
        )


def _next(columns: Iterator[Array], shape: tuple[int, ...]) -> Array:
    return next(columns)


def _with_axes(telemetry: Array) -> Array:
    return telemetry if telemetry.ndim == 4 else telemetry.reshape(WIDTH, -1, 4, 0)
