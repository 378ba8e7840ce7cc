"""The base's torque over a flight: what pictures of several flights draw of each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.bag.flight_log import FlightLog

from ..waypoints import junction_ticks

Array = NDArray[np.float64]


class BaseTorque(NamedTuple):
    """A fiftieth of the flight's log, to hand from process to process."""

    torque: Array
    """(N, 3) N m, applied in the base frame."""
    period: float
    """s, of a tick."""
    junctions: NDArray[np.intp]
    """Rows at which one motion has ended and another begins."""
    start: float = 0.0
    """s, time of the first row: not 0 in an excerpt of a flight."""

    @classmethod
    def of(cls, log: FlightLog) -> Self:
        """Of a whole flight."""
        period = log.timebase.period
        return cls(
            log.applied_torque[:, :3].copy(), period, junction_ticks(log), log.first_tick * period
        )

    @property
    def time(self) -> Array:
        """(N,) s, of the ticks."""
        return self.start + np.arange(len(self.torque), dtype=np.float64) * self.period

    @property
    def end(self) -> float:
        """Of the flight, s."""
        return self.start + len(self.torque) * self.period
