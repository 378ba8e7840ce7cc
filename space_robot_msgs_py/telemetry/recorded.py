"""Telemetry of a flight log: the values of its signals, and its events."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..bag.flight_log import FlightLog
from ..errors import InputError
from ..samples import SIGNALS, TelemetrySignals
from ..signals import signals_of
from .downlink import EventKind, TelemetryEvent
from .structures import REFERENCE_PREFIX, UNKNOWN_LAW, Array, Columns, numbers_of_laws


def log_columns(log: FlightLog, laws: Sequence[str]) -> Columns:
    """Return the values of signals in a log, as the flight software knows them.

    Args:
        log: of a flight, or of a part of it.
        laws: names of the laws that have numbers in telemetry.
    """
    measured, telemetry = log.as_measured(), list(signals_of(TelemetrySignals))
    references = log.references(log.first_tick, log.first_tick + log.ticks)

    def column(name: str) -> Array:
        if name == "law":
            return _law_numbers(log, laws)
        if name.startswith(REFERENCE_PREFIX):
            return np.asarray(references[name.removeprefix(REFERENCE_PREFIX)])
        if name in telemetry:
            if log.telemetry is not None:
                return np.asarray(log.telemetry[:, telemetry.index(name)])
            values = None
        else:
            values = getattr(measured if name in SIGNALS else log, name)
        if values is None:
            raise InputError(f"signal {name!r} is not in this log")
        return np.asarray(values)

    return column


def log_events(log: FlightLog, laws: Sequence[str]) -> Iterator[TelemetryEvent]:
    """Yield the changes of the law in a log; ``laws`` as in `log_columns`."""
    numbers = numbers_of_laws(laws)
    for law in log.laws:
        if log.first_tick <= law.tick < log.first_tick + log.ticks:
            number = numbers.get(law.name, UNKNOWN_LAW)
            yield TelemetryEvent(law.tick, EventKind.LAW_IN_FORCE, number)


def _law_numbers(log: FlightLog, laws: Sequence[str]) -> Array:
    numbers, values = numbers_of_laws(laws), np.full(log.ticks, float(UNKNOWN_LAW))
    for law in log.laws:
        values[max(0, law.tick - log.first_tick) :] = numbers.get(law.name, UNKNOWN_LAW)
    return values
