"""A part of a flight, by time."""

from __future__ import annotations

import math

import numpy as np

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

ROUNDING = 1e-6
"""Ticks by which a time may miss the tick it means."""


def excerpt(log: FlightLog, from_s: float | None, to_s: float | None) -> FlightLog:
    """Return the ticks with ``from_s <= t < to_s``, views into the arrays of ``log``.

    What was lost or filled is not known by time: these counts stay those of the whole flight.
    Unanswered ticks are counted anew where the commands are known.

    Args:
        log: a flight.
        from_s: s (None: from its start).
        to_s: s (None: to its end).

    Raises:
        InputError: the times are reversed, outside the flight, or hold not one tick.
    """
    if from_s is None and to_s is None:
        return log
    period = log.timebase.period
    begin, end = log.first_tick * period, (log.first_tick + log.ticks) * period
    low, high = begin if from_s is None else from_s, end if to_s is None else to_s
    limits = " ".join(
        f"--{name} {value:g}"
        for name, value in (("from", from_s), ("to", to_s))
        if value is not None
    )
    if low >= high and None not in (from_s, to_s):
        raise InputError(f"{limits}: the start must come before the end")
    if not (begin - ROUNDING * period <= low < end and begin < high <= end + ROUNDING * period):
        raise InputError(f"{limits}: outside the flight, which lasts from {begin:g} to {end:g} s")
    first, stop = (math.ceil(t / period - ROUNDING) - log.first_tick for t in (low, high))
    if first >= stop:
        raise InputError(f"{limits}: no tick lies between (one every {period:g} s)")
    cut = log.rows(first, stop)
    if cut.commanded_torque is not None:
        cut.unanswered = int(np.count_nonzero(np.isnan(cut.commanded_torque[:, 0])))
    return cut
