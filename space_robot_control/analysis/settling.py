"""How soon after a motion's end the error has died away."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.flight_log import FlightLog

from .waypoints import waypoint_ticks

Array = NDArray[np.float64]

BAND = 1e-5
"""Largest |error| that counts as settled: rad on a joint; on eps, which is 4.1 arcsec."""
SHORTEST_WATCH = 0.1
"""s of flight after a waypoint without which nothing can be said of settling there."""


def last_waypoint(log: FlightLog) -> int | None:
    """Row of the last waypoint with `SHORTEST_WATCH` of flight after it; None: there is none.

    A waypoint is where all desired joint velocities vanish, the start of the flight included. The
    last one of the paper's mission is its last tick, so that the one at 15 s is taken.
    """
    watched = log.ticks - round(SHORTEST_WATCH / log.timebase.period)
    ticks = waypoint_ticks(log)
    ticks = ticks[ticks <= watched]
    if not len(ticks) or np.max(np.abs(log.reference_joints[ticks[-1], 1])) > _slow(log):
        return None
    return int(ticks[-1])


def settling_time(error: Array, start: int, period: float, band: float = BAND) -> float | None:
    """The shortest time after row ``start`` from which ``error`` stays within ``band`` to its end.

    As in control engineering (e.g. Ogata, Modern Control Engineering, 5-3), with a band in
    absolute terms: a tracking error has no final value to take a share of.

    Args:
        error: (N, axes); the largest of the axes counts.
        start: row of the waypoint.
        period: s, from row to row.
        band: unit of the error.

    Returns:
        s; 0 where it never leaves the band, None where it is outside at the end.
    """
    outside = np.flatnonzero(np.max(np.abs(error[start:]), axis=1) > band)
    if not len(outside):
        return 0.0
    settled = int(outside[-1]) + 1
    return None if settled == len(error) - start else settled * period


def _slow(log: FlightLog) -> float:
    """rad/s below which the arm counts as resting: an excerpt may hold no rest at all."""
    return 1e-3 * float(np.max(np.abs(log.reference_joints[:, 1])))
