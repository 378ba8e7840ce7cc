"""Deflection of joints with gears: motor angle less link angle, seen through the gear."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog, Metric

from .metrics import AxisMaximum, AxisRms

Array = NDArray[np.float64]


class Deflection(Metric):
    """RMS and largest deflection of each joint with a gear, rad (prismatic joints: m)."""

    def __init__(self, log: FlightLog) -> None:
        """``log``: the first rows."""
        self._names = log.geared_names
        self._rms, self._maximum = (kind(len(self._names)) for kind in (AxisRms, AxisMaximum))

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        for measure in (self._rms, self._maximum):
            measure.add(deflection(log))

    def result(self) -> dict[str, dict[str, float]]:
        """Return ``largest`` and ``rms`` by joint."""
        each = {"largest": self._maximum.value, "rms": self._rms.value}
        return {
            name: dict(zip(self._names, values.tolist(), strict=True))
            for name, values in each.items()
        }


def deflection(log: FlightLog) -> Array:
    """Return ``theta_m - theta`` (N, G) of the joints with gears, rad or m."""
    joints = [log.joint_names.index(name) for name in log.geared_names]
    difference: Array = log.motor_positions - log.joint_positions[:, joints]
    return difference
