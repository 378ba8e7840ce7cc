"""Captures of targets on neighbouring orbits that the tool did not reach."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog, Metric
from space_robot_sim.environment.captures import Captures

from .momentum import happens_in

Array = NDArray[np.float64]


class MissedCaptures(Metric):
    """Finds the captures of a flight that missed their target, which then did not happen."""

    def __init__(self, captures: Captures) -> None:
        """``captures``: of the robot that flew."""
        self._captures = captures

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        start, stop = log.first_tick, log.first_tick + log.ticks
        for tick in self._captures.ticks(start, stop):
            row = log.rows(tick - start, tick - start + 1)
            for exchange in self._captures.at(tick):
                happens_in(self._captures, exchange, row)

    def result(self) -> dict[str, float]:
        """Return distances by event, m: of the target from where the tool would have held it."""
        misses = self._captures.misses
        return {
            exchange.event.label: misses[exchange.tick]
            for exchange in self._captures.exchanges
            if exchange.tick in misses and exchange.target_state
        }
