"""The log of a flight in this process: its columns, before the flight and after an early end."""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog, block_bounds, of_nan
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import ReferenceChunk
from space_robot_msgs_py.wire.messages import TELEMETRY_ROWS

from .plan import Flight

MAPPED_FROM = 2**30
"""Bytes from which on a log lies in files, which have no names and go with it."""


def flight_log(
    flight: Flight, ticks: int | None = None, description: dict[str, Any] | None = None
) -> FlightLog:
    """Return the log of the first ``ticks`` (None: all) before they are flown, see `empty_log`."""
    ticks = flight.ticks if ticks is None else ticks
    if (size := ticks * row_bytes(flight)) < MAPPED_FROM:
        return empty_log(flight, 0, ticks, description=description)
    check_room(size, f"duration {ticks * flight.period:g} s")
    first = flight.mission.chunk(0, 1)
    log = empty_log(flight, 0, ticks, mapped, first, description=description)
    joints, base = log.reference_joints, log.reference_base
    log.reference_joints = mapped((ticks, *joints.shape[1:]))
    log.reference_base = mapped((ticks, *base.shape[1:]))
    for start, stop in block_bounds(ticks):
        chunk = flight.mission.chunk(start, stop - start)
        log.reference_joints[start:stop], log.reference_base[start:stop] = chunk.joints, chunk.base
    return log


def new_array(count: int, what: str) -> Array:
    """Return an array of ``count`` numbers, in a file if it is large."""
    if 8 * count < MAPPED_FROM:
        return np.empty(count)
    check_room(8 * count, what)
    return mapped((count,))


def mapped(shape: tuple[int, ...]) -> Array:
    """Return an array in a file without a name, which the system writes out as it needs."""
    if not math.prod(shape):
        return np.empty(shape)
    with tempfile.TemporaryFile() as file:
        return np.memmap(file, np.float64, "w+", shape=shape)


def check_room(size: int, what: str) -> None:
    """Check that files of ``size`` bytes fit into the folder for temporary files."""
    folder = tempfile.gettempdir()
    free = shutil.disk_usage(folder).free
    if size > free:
        raise InputError(
            f"{what}: the whole log needs {size / 1e9:.1f} GB in {folder}, "
            f"{free / 1e9:.1f} GB are free: fly a shorter one, or set TMPDIR"
        )


def empty_log(
    flight: Flight,
    start: int = 0,
    stop: int | None = None,
    allocate: Callable[[tuple[int, ...]], Array] = of_nan,
    reference: ReferenceChunk | None = None,
    is_brief: bool = False,
    description: dict[str, Any] | None = None,
) -> FlightLog:
    """Return the log of the ticks ``start`` to ``stop`` (None: the last) before the flight.

    The reference alone is known; it may have been computed. ``allocate`` makes the columns that the
    flight fills. ``is_brief``: with what metrics need only, see `Flight.brief`. ``description``:
    of the flight (None: all that is known).
    """
    if description is None:
        description = flight.brief if is_brief else flight.description
    log = allocate_columns(
        flight, (flight.ticks if stop is None else stop) - start, allocate, is_brief
    )
    log.first_tick, log.scenario, log.flight = start, flight.scenario, description
    log.lost = {topic.full_name: 0 for topic in topics.ALL}
    reference = reference or flight.mission.chunk(start, log.ticks)
    log.reference_joints, log.reference_base = reference.joints, reference.base
    return log


def allocate_columns(
    flight: Flight,
    ticks: int,
    allocate: Callable[[tuple[int, ...]], Array] = of_nan,
    is_brief: bool = False,
) -> FlightLog:
    """Return the columns of a log, see `empty_log`; if ``is_brief``, of true states only."""
    log = FlightLog.allocate(ticks, flight.plant.names, flight.timebase, allocate)
    if is_brief:
        return log
    log.commanded_torque = allocate(log.applied_torque.shape)
    log.telemetry = allocate((ticks, 4, log.axes))
    if not flight.plant.measures_truth:
        log.record_measured(allocate, flight.plant.names)
    return log


def note_assumed_errors(flight: Flight, block: FlightLog, start: int, stop: int) -> None:
    """Copy the errors in the law's telemetry of the ticks ``start`` to ``stop``."""
    if block.assumed_error is None:
        return
    assert block.telemetry is not None
    every = flight.controller_settings.telemetry_decimation
    rows = slice(-(-start // every) * every - block.first_tick, stop - block.first_tick, every)
    block.assumed_error[rows] = block.telemetry[rows, TELEMETRY_ROWS.index("e")]


def ended_early(block: FlightLog, measured: int, answered: int) -> FlightLog:
    """Return the first ``measured`` rows; those from ``answered`` on have no command."""
    for column in (block.commanded_torque, block.actuator_commands, block.telemetry):
        if column is not None:
            column[answered:] = np.nan
    block.unanswered = measured - answered
    block.laws = tuple(law for law in block.laws if law.tick < block.first_tick + answered)
    return block.rows(0, measured)


def row_bytes(flight: Flight) -> int:
    """Return the size of a tick in a log."""
    row = allocate_columns(flight, 1)
    columns = [*row.columns.values(), *(row.measured.columns.values() if row.measured else ())]
    return sum(column.nbytes for column in columns)
