"""Logs of eight flights whose columns are parts of common arrays, for the compiled loop."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.samples import ALL_FIELDS, ReferenceChunk, State
from space_robot_sim.plant.tick import PlantMemory

from ..flown_log import MAPPED_FROM, columns_of, empty_log, mapped
from ..plan import Flight
from .lane_loop import LaneLog, References

Array = NDArray[np.float64]


class LogsInLanes:
    """Logs of up to eight flights over the same ticks."""

    def __init__(self, flights: Sequence[Flight], ticks: int, is_brief: bool = False) -> None:
        """Allocate logs of ``ticks`` rows; ``is_brief``: see `empty_log`."""
        columns = _columns(flights[0], ticks, is_brief)
        self.logs = []
        """One of each flight."""
        chunks: dict[int, ReferenceChunk] = {}
        for lane, flight in enumerate(flights):
            mission = flight.mission
            if id(mission) not in chunks:
                chunks[id(mission)] = mission.chunk(0, ticks)
            own = partial(_next, iter([column[lane] for column in columns]))
            self.logs.append(empty_log(flight, 0, ticks, own, chunks[id(mission)], is_brief))
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
            np.stack([_places(part, flights[0].robot.n) for part in ("truth", "measured")]),
            common(log.commanded_torque),
            common(log.actuator_commands),
            np.empty((WIDTH, 0, 4, 0)) if log.telemetry is None else common(log.telemetry),
        )
        places = list(chunks)
        self.references = References(
            np.stack([_numbers(chunk) for chunk in chunks.values()]),
            np.array([places.index(id(f.mission)) for f in flights] + [0] * WIDTH)[:WIDTH],
        )
        """Desired motion of the flights."""


def _columns(flight: Flight, ticks: int, is_brief: bool) -> list[Array]:
    """Return the columns (8, N, ...) that `empty_log` asks for, in its order.

    They are parts of one array, large enough for the pages of memory that the system has for such,
    or in a file if it is too large for memory.
    """
    shapes: list[tuple[int, ...]] = []

    def asked(shape: tuple[int, ...]) -> Array:
        shapes.append(shape[1:])
        return np.empty(shape)

    columns_of(flight, 1, asked, is_brief)
    counts = [WIDTH * ticks * int(np.prod(shape, dtype=int)) for shape in shapes]
    room = mapped((sum(counts),)) if 8 * sum(counts) >= MAPPED_FROM else np.empty(sum(counts))
    parts = np.split(room, np.cumsum(counts)[:-1])
    return [part.reshape(WIDTH, ticks, *shape) for part, shape in zip(parts, shapes, strict=True)]


def _places(state: str, n: int) -> NDArray[np.int64]:
    """Return where the signals of a state begin in a `PlantMemory`."""
    fields, signals = PlantMemory.dtype(n).fields, State.dtype(n).fields
    assert fields is not None
    assert signals is not None
    return np.array([(fields[state][1] + signals[name][1]) // 8 for name in ALL_FIELDS])


def _next(columns: Iterator[Array], shape: tuple[int, ...]) -> Array:
    return next(columns)


def _numbers(chunk: ReferenceChunk) -> Array:
    """Return the numbers (N, ...) of the `Reference` of each tick."""
    numbers: Array = chunk.references().view(np.float64)
    return numbers.reshape(len(chunk.joints), -1)
