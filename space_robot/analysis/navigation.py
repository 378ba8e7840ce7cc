"""Navigation error: how far the state that the law assumed was from the true one.

The law tells the error e that it sees in its telemetry. Less the true one this is the true state
less the assumed one, in the coordinates rho = [eps_e, theta], whatever stands between sensors and
law: ``e - e_true = rho - rho_assumed``. So it holds of measured states and of filtered ones, but
is known at the ticks of the telemetry only.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog, Metric
from space_robot_msgs_py.errors import InputError

from .attitude_drift import controls_base
from .metrics import (
    AxisMaximum,
    AxisRms,
    error_columns,
    quaternions_of,
    relative_attitude,
    rotation_vectors,
)

Array = NDArray[np.float64]


class NavigationError(Metric):
    """Takes RMS and maximum of the navigation error by error column of Table V."""

    def __init__(self, log: FlightLog) -> None:
        """``log``: the first rows."""
        self._columns = error_columns(log.axes, controls_base(log), log.prismatic, log.branches)
        self._rms, self._maximum = AxisRms(log.axes), AxisMaximum(log.axes)
        self._angle_rms, self._angle_maximum = AxisRms(3), AxisMaximum(3)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        if log.assumed_error is None:
            return
        errors = navigation_error(log, error)
        self._rms.add(errors)
        self._maximum.add(errors)
        angles = np.degrees(assumed_rotation(log, error))
        self._angle_rms.add(angles)
        self._angle_maximum.add(angles)

    def result(self) -> dict[str, Any]:
        """Return the ticks with telemetry, ``rms`` (mean of axes) and ``max`` by column.

        With ``attitude_deg``, which has the angles of the attitude's.
        """
        if not self._rms.rows:
            raise InputError("no telemetry was recorded")
        rms, largest = self._rms.value, self._maximum.value
        attitude = {
            "rms": float(np.mean(self._angle_rms.value)),
            "max": float(np.max(self._angle_maximum.value)),
        }
        return {
            "ticks": self._rms.rows,
            "rms": {name: float(np.mean(rms[axes])) for name, axes in self._columns.items()},
            "max": {name: float(np.max(largest[axes])) for name, axes in self._columns.items()},
            **({"attitude_deg": attitude} if "attitude" in self._columns else {}),
        }


def navigation_error(log: FlightLog, error: Array) -> Array:
    """(K, n+3) true coordinates less the assumed ones at the ticks with telemetry.

    They are eps_e, then rad or m.

    Args:
        log: with `FlightLog.assumed_error`.
        error: (N, n+3) its true tracking error.
    """
    assert log.assumed_error is not None
    known = np.isfinite(log.assumed_error).all(axis=1)
    difference: Array = log.assumed_error[known] - error[known]
    return difference


def assumed_rotation(log: FlightLog, error: Array) -> Array:
    """(K, 3) rad, rotation vector from the assumed attitude to the true one, at the same ticks.

    ``log`` and ``error`` as in `navigation_error`.
    """
    assert log.assumed_error is not None
    known = np.isfinite(log.assumed_error).all(axis=1)
    assumed, true = (quaternions_of(-e[known, :3]) for e in (log.assumed_error, error))
    return rotation_vectors(relative_attitude(assumed, true))
