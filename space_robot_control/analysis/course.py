"""What pictures of several flights draw of each, so that the flights need not stay in memory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from .described import robot_of
from .metrics import error_columns, torque_columns, tracking_error
from .pointing import PointingError, pointing_error

Array = NDArray[np.float64]


class Course(NamedTuple):
    """Sizes of a flight's errors and torques over time."""

    time: Array
    """(N,) s."""
    errors: dict[str, Array]
    """(N,) norm of the error of each column of Table V: eps, rad."""
    torques: dict[str, Array]
    """(N,) norm of the torque of each column of Table V, N m."""
    pointing: PointingError | None
    """None where the robot is not known."""
    latency_ms: Array | None
    """(K,) of every answer, by the wall clock; None for flights without any."""

    @classmethod
    def of(cls, log: FlightLog) -> Self:
        """Of a whole flight or an excerpt."""
        error = tracking_error(log)
        try:
            pointing = pointing_error(log, robot_of(log))
        except InputError:
            pointing = None
        latency = None
        if log.latency_s is not None:
            known = log.latency_s[np.isfinite(log.latency_s)]
            latency = 1e3 * known if len(known) else None
        return cls(
            np.arange(log.first_tick, log.first_tick + log.ticks, dtype=np.float64)
            * log.timebase.period,
            {
                name: np.linalg.norm(error[:, axes], axis=1)
                for name, axes in error_columns(log.axes).items()
            },
            {
                name: np.linalg.norm(log.applied_torque[:, axes], axis=1)
                for name, axes in torque_columns(log.axes).items()
            },
            pointing,
            latency,
        )
