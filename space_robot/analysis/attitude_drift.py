"""Attitude drift of a base without attitude control.

The arm's motion turns a base without actuators by momentum exchange. No law may be measured by
that attitude, so it has no error: the metric is the angle from the initial attitude.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog, Metric

from .metrics import relative_attitude, rotation_vectors

Array = NDArray[np.float64]

FREE = "nothing turns the base"
UNAVAILABLE = {
    "attitude": f"{FREE}, so its attitude drifts and is no error",
    "base_torque": f"{FREE}, for it has no actuators",
}
"""Columns that a flight with a free base does not have, and why."""


def controls_base(log: FlightLog) -> bool:
    """Return whether the base had actuators; else it floated freely."""
    described = log.flight.get("base_actuators")
    return not (isinstance(described, dict) and described.get("base_actuation") == "none")


class AttitudeDrift(Metric):
    """Largest and final rotation angle of the base since the first tick, degrees."""

    def __init__(self, log: FlightLog) -> None:
        """``log``: the first rows."""
        self._start = log.quaternion[0].copy()
        self._largest = self._end = 0.0

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        angle = np.linalg.norm(attitude_drift(log, self._start), axis=1)
        self._largest = max(self._largest, float(angle.max()))
        self._end = float(angle[-1])

    def result(self) -> dict[str, float]:
        """Return ``max_deg`` and ``end_deg``."""
        return {"max_deg": self._largest, "end_deg": self._end}


def attitude_drift(log: FlightLog, start: Array | None = None) -> Array:
    """(N, 3) deg, the rotation vector of the base, on its axes, from where it was to each tick.

    ``start``: (4,) the attitude to count from (None: that of the first row).
    """
    first = log.quaternion[0] if start is None else start
    turned = relative_attitude(np.broadcast_to(first, log.quaternion.shape), log.quaternion)
    drift: Array = np.degrees(rotation_vectors(turned))
    return drift
