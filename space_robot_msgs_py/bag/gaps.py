"""Ticks of a flight whose state was kept back or spoilt: filled as the flight software does."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..flight_log import FlightLog

STATE = (
    "base_position", "quaternion", "base_velocity", "omega_base", "joint_positions",
    "joint_velocities", "applied_torque",
)  # fmt: skip
REFERENCE = ("reference_joints", "reference_base")


def complete_rows(log: FlightLog) -> NDArray[np.bool_]:
    """(N,) whether state and reference of a tick are there and finite."""
    return _finite(log, STATE) & _finite(log, REFERENCE)


def fill_gaps(log: FlightLog) -> None:
    """Give ticks without a usable state the one before, and missing references the last point.

    From the first whole tick to the last state; `FlightLog.filled` counts the states.
    """
    states = _finite(log, STATE)
    end = len(states) - int(np.argmax(states[::-1])) if states.any() else 0
    log.filled = int(np.count_nonzero(~states[:end]))
    _repeat_before(log, STATE, states, end)
    references = _finite(log, REFERENCE)
    _repeat_before(log, REFERENCE, references, end)
    log.reference_joints[:end][~references[:end], 1:] = 0.0  # at rest
    log.reference_base[:end][~references[:end], 4:] = 0.0


def _repeat_before(
    log: FlightLog, columns: tuple[str, ...], good: NDArray[np.bool_], end: int
) -> None:
    source = np.maximum.accumulate(np.where(good[:end], np.arange(end), -1))
    bad = np.flatnonzero(~good[:end] & (source >= 0))
    for name in columns:
        column: Any = getattr(log, name)
        column[bad] = column[source[bad]]


def _finite(log: FlightLog, columns: tuple[str, ...]) -> NDArray[np.bool_]:
    rows = [np.isfinite(getattr(log, name).reshape(log.ticks, -1)).all(axis=1) for name in columns]
    finite: NDArray[np.bool_] = np.logical_and.reduce(rows)
    return finite
