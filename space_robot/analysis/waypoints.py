"""Waypoints between the segments of a mission, detected in the reference."""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]

SLOW = 1e-4
"""Share of the highest desired speed so far below which a waypoint is near."""
AT_REST = 1e-9
"""Share of the highest desired speed so far that is no motion."""


class Waypoints:
    """Finds the rows at which all desired joint velocities vanish, in a reference in parts.

    Slow is what is slow beside all that came before, so that no row has to be looked at twice.
    """

    def __init__(self) -> None:
        self.rows = 0
        """Rows so far."""
        self.highest = 0.0
        """The highest desired speed so far, rad/s."""
        self._found: list[int] = []
        self._near: _Near | None = None
        """The slow stretch that the last row belongs to."""

    def add(self, reference_joints: Array) -> None:
        """Take further rows (N, 3, n)."""
        if not len(reference_joints):
            return
        speed = reduce(np.maximum, np.abs(reference_joints[:, 1].T))
        highest = np.fmax.accumulate(np.concatenate([[self.highest], speed]))[1:]
        slow, rests = speed <= SLOW * highest, speed <= AT_REST * highest
        edges = np.flatnonzero(np.diff(slow.astype(np.int8), prepend=0, append=0))
        if not slow[0]:
            self._leave()
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            self._near = self._near or _Near()
            self._near.add(speed[begin:end], rests[begin:end], self.rows + int(begin))
            if end < len(speed):
                self._leave()
        self.rows += len(speed)
        self.highest = float(highest[-1])

    def found(self) -> NDArray[np.intp]:
        """Their rows, rising; both ends of a longer rest.

        The waypoint of a segment whose end has not come is not among them.
        """
        now = self._near.waypoints if self._near else []
        return np.unique(np.array([*self._found, *now], dtype=np.intp))  # there may be none

    def forget_before(self, row: int) -> None:
        """Keep of the waypoints up to ``row`` only the last."""
        passed = [k for k in self._found if k <= row]
        self._found = [*passed[-1:], *self._found[len(passed) :]]

    def _leave(self) -> None:
        if self._near:
            self._found += self._near.waypoints
            self._near = None


class _Near:
    """A stretch of slow rows."""

    def __init__(self) -> None:
        self._resting: tuple[int, int] | None = None
        self._slowest, self._slowest_row = np.inf, -1

    def add(self, speed: Array, rests: NDArray[np.bool_], row: int) -> None:
        """Take further rows, of which ``row`` is the first."""
        resting = np.flatnonzero(rests)
        if len(resting):
            first = self._resting[0] if self._resting else row + int(resting[0])
            self._resting = first, row + int(resting[-1])
        slowest = int(np.argmin(speed))
        if speed[slowest] < self._slowest:
            self._slowest, self._slowest_row = float(speed[slowest]), row + slowest

    @property
    def waypoints(self) -> list[int]:
        """Both ends of the rest, or the slowest row where the waypoint lies between two ticks."""
        return list(self._resting or (self._slowest_row,))


def waypoint_ticks(log: FlightLog) -> NDArray[np.intp]:
    """`Waypoints` of a whole log; of an arm that never moves the first row alone."""
    waypoints = Waypoints()
    waypoints.add(log.reference_joints)
    return waypoints.found() if waypoints.highest > 0.0 else np.array([0])


def junction_ticks(log: FlightLog) -> NDArray[np.intp]:
    """Waypoints inside the flight, where a motion has ended and another begins."""
    ticks = waypoint_ticks(log)
    return ticks[(ticks > 0) & (ticks < log.ticks - 1)]
