"""Ticks without a usable state, filled as the flight software fills them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..samples import ACTUATOR_FIELDS, PASSIVE_FIELDS, STATE_FIELDS
from .flight_log import REFERENCE, FlightLog, MeasuredStates, finite_rows


def fill_gaps(log: FlightLog) -> None:
    """Give ticks without a usable state the one before, and missing references the last point.

    From the first whole tick to the last state; `FlightLog.filled` counts the states. Only what
    the sensors report is filled in: the truth has no such gaps.
    """
    measured = log if log.measured is None else log.measured
    states = finite_rows(getattr(measured, name) for name in STATE_FIELDS)
    known = log.finite(STATE_FIELDS) | states
    end = len(known) - int(np.argmax(known[::-1])) if known.any() else 0
    log.filled = int(np.count_nonzero(~states[:end]))
    _repeat_before(measured, STATE_FIELDS, states, end)
    passive = finite_rows(getattr(measured, name) for name in PASSIVE_FIELDS)
    _repeat_before(measured, PASSIVE_FIELDS, passive, end)
    _repeat_before(log, ACTUATOR_FIELDS, log.finite(ACTUATOR_FIELDS), end)
    references = log.finite(REFERENCE)
    _repeat_before(log, REFERENCE, references, end)
    log.reference_joints[:end][~references[:end], 1:] = 0.0  # at rest
    log.reference_base[:end][~references[:end], 4:] = 0.0


def _repeat_before(
    log: FlightLog | MeasuredStates, columns: tuple[str, ...], good: NDArray[np.bool_], end: int
) -> None:
    source = np.maximum.accumulate(np.where(good[:end], np.arange(end), -1))
    bad = np.flatnonzero(~good[:end] & (source >= 0))
    for name in columns:
        column: Any = getattr(log, name)
        column[bad] = column[source[bad]]
