"""The base's torque over a flight: what pictures of several flights draw of each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.flight_log import FlightLog

from .waypoints import junction_ticks

Array = NDArray[np.float64]


class BaseTorque(NamedTuple):
    """A fiftieth of the flight's log, to hand from process to process."""

    torque: Array
    """(N, 3) N m, applied in the base frame."""
    period: float
    """s, of a tick."""
    junctions: NDArray[np.intp]
    """Ticks at which one motion has ended and another begins."""

    @classmethod
    def of(cls, log: FlightLog) -> Self:
        """Of a whole flight."""
        return cls(log.applied_torque[:, :3].copy(), log.timebase.period, junction_ticks(log))

    @property
    def time(self) -> Array:
        """(N,) s, of the ticks."""
        return np.arange(len(self.torque), dtype=np.float64) * self.period

    @property
    def duration(self) -> float:
        """Of the flight, s."""
        return len(self.torque) * self.period
