"""Where a mission's segments meet, found in the flight's reference: there the arm shall rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.flight_log import FlightLog

SLOW = 1e-4
"""Share of the highest desired speed below which a waypoint is near."""
AT_REST = 1e-9
"""Share of the highest desired speed that is no motion."""


def waypoint_ticks(log: FlightLog) -> NDArray[np.intp]:
    """Ticks at which all desired joint velocities vanish, rising; both ends of a longer rest.

    The waypoint of a segment that the log does not reach the end of is not among them.
    """
    speed = np.max(np.abs(log.reference_joints[:, 1]), axis=1, initial=0.0)
    highest = np.nanmax(speed, initial=0.0)
    if highest == 0.0:
        return np.array([0])
    slow = np.concatenate([[False], speed < SLOW * highest, [False]])
    edges = np.flatnonzero(slow[1:] != slow[:-1])
    ticks = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        resting = np.flatnonzero(speed[begin:end] <= AT_REST * highest)
        if len(resting) == 0:  # the waypoint lies between two ticks
            resting = np.array([np.argmin(speed[begin:end])])
        ticks += [begin + resting[0], begin + resting[-1]]
    return np.unique(np.array(ticks, dtype=np.intp))  # an excerpt may have none


def junction_ticks(log: FlightLog) -> NDArray[np.intp]:
    """Waypoints inside the flight, where a motion has ended and another begins."""
    ticks = waypoint_ticks(log)
    return ticks[(ticks > 0) & (ticks < log.ticks - 1)]
