"""Settling time: from a motion's end until the error has died away."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog, Metric
from space_robot_msgs_py.errors import InputError

from .attitude_drift import controls_base
from .metrics import error_columns, largest_of_columns
from .waypoints import Waypoints

Array = NDArray[np.float64]

BAND = 1e-5
"""Largest |error| that counts as settled: rad or m on a joint; on eps, which is 4.1 arcsec."""
SHORTEST_WATCH = 0.1
"""s of flight after a waypoint without which nothing can be said of settling there."""


class Settling(Metric):
    """The shortest time after the last waypoint from which each error column stays in `BAND`.

    As in control engineering (e.g. Ogata, Modern Control Engineering, 5-3), with a band in
    absolute terms: a tracking error has no final value to take a share of.
    """

    def __init__(self, log: FlightLog, band: float = BAND) -> None:
        """``log``: the first rows; ``band``: unit of the error, for the largest of the axes."""
        self._first_tick, self._period, self._band = log.first_tick, log.timebase.period, band
        self._waypoints = Waypoints()
        self._columns = error_columns(log.axes, controls_base(log), log.prismatic, log.branches)
        self._outside = dict.fromkeys(self._columns, -1)
        """Last row outside the band, by column."""

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        before = self._waypoints.rows
        for name, axes in self._columns.items():
            outside = largest_of_columns(error[:, axes]) > self._band
            if outside.any():
                self._outside[name] = before + len(error) - 1 - int(np.argmax(outside[::-1]))
        self._waypoints.add(log.reference_joints)
        self._waypoints.forget_before(self._last_watched)

    def result(self) -> dict[str, Any]:
        """Return the band, the time counted from, and s by column: None if outside at the end."""
        start = self.last_waypoint
        if start is None:
            raise InputError("the arm does not come to rest with flight left after it")
        return {
            "band": self._band,
            "after_s": (self._first_tick + start) * self._period,
            "settled_s": {name: self._settled(row, start) for name, row in self._outside.items()},
        }

    @property
    def last_waypoint(self) -> int | None:
        """Row of the last waypoint with `SHORTEST_WATCH` of flight after it; None: there is none.

        A waypoint is where all desired joint velocities vanish, the start of the flight included.
        The last one of the paper's mission is its last tick, so that the one at 15 s is taken.
        """
        rows = self._waypoints.found()
        watched = rows[rows <= self._last_watched]
        return int(watched[-1]) if len(watched) else None

    @property
    def _last_watched(self) -> int:
        return self._waypoints.rows - round(SHORTEST_WATCH / self._period)

    def _settled(self, outside: int, start: int) -> float | None:
        if outside < start:
            return 0.0
        settled = outside + 1
        return None if settled == self._waypoints.rows else (settled - start) * self._period
