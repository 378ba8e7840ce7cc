"""Waypoints between the segments of a mission, detected in the reference, and settling there."""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from .analysed_log import AnalysedLog
from .errors import joined_error
from .series import Definition, largest_sizes, metrics

Array = NDArray[np.float64]

SLOW = 1e-4
"""Share of the highest desired speed so far below which a waypoint is near."""
AT_REST = 1e-9
"""Share of the highest desired speed so far that is no motion."""
BAND = 1e-5
"""Largest |error| that counts as settled: rad or m on a joint; on eps, which is 4.1 arcsec."""
SHORTEST_WATCH = 0.1
"""s of flight after a waypoint without which nothing can be said of settling there."""


def waypoint_ticks(log: FlightLog) -> NDArray[np.intp]:
    """Return the rows at which all desired joint velocities vanish; both ends of a longer rest.

    Where none is exactly 0 at a tick, the slowest one counts. Of an arm that never moves it is the
    first row.
    """
    speed: Array = reduce(np.maximum, (np.abs(own) for own in log.reference_joints[:, 1].T))
    highest = np.fmax.accumulate(speed)
    if not len(speed) or not highest[-1] > 0.0:
        return np.array([0])
    slow, rests = speed <= SLOW * highest, speed <= AT_REST * highest
    edges = np.flatnonzero(np.diff(slow.astype(np.int8), prepend=0, append=0))
    waypoints: list[int] = []
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        resting = begin + np.flatnonzero(rests[begin:end])
        slowest = begin + int(np.argmin(speed[begin:end]))
        waypoints += [int(resting[0]), int(resting[-1])] if len(resting) else [slowest]
    return np.unique(np.array(waypoints, dtype=np.intp))


def junction_ticks(log: FlightLog) -> NDArray[np.intp]:
    """Waypoints inside the flight, where a motion has ended and another begins."""
    ticks = waypoint_ticks(log)
    return ticks[(ticks > 0) & (ticks < log.ticks - 1)]


@metrics(
    "settling",
    {
        "{error}.settling": Definition(
            "s",
            "time from the last waypoint after which the error stays to the end within "
            f"{BAND:g} rad or m on joints, and 4.1 arcsec of the attitude's error on each axis",
        ),
        "settling.after": Definition("s", "time of the waypoint from which settling counts"),
    },
)
def settling(flight: AnalysedLog) -> dict[str, float]:
    """Compute the time from which each error column stays in `BAND`; inf: outside at the end.

    As in control engineering (e.g. Ogata, Modern Control Engineering, 5-3), with a band in
    absolute terms: a tracking error has no final value to take a share of. The last waypoint of the
    paper's mission is its last tick, so that the one at 15 s is taken.
    """
    log, period = flight.log, flight.log.timebase.period
    rows = waypoint_ticks(log)
    watched = rows[rows <= log.ticks - round(SHORTEST_WATCH / period)]
    if not len(watched):
        raise InputError("the arm does not come to rest with flight left after it")
    waypoint = int(watched[-1])
    last = dict.fromkeys(flight.error_columns, waypoint - 1)
    for start, stop in flight.blocks():
        error = joined_error(log.rows(start, stop), flight.attitude_errors(start, stop))
        for name, axes in flight.error_columns.items():
            outside = largest_sizes(error[:, axes]) > BAND
            if outside.any():
                row = start + len(outside) - 1 - int(np.argmax(outside[::-1]))
                last[name] = max(last[name], row)
    numbers = {"settling.after": (log.first_tick + waypoint) * period}
    for name, row in last.items():
        is_settled = row < log.ticks - 1
        numbers[f"{name}.settling"] = (row + 1 - waypoint) * period if is_settled else np.inf
    return numbers
