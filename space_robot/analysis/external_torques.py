"""Torques on the robot from outside, by source: of the orbit, and the sines of (61)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.sine import sines_cosines
from space_robot_msgs_py.bag.blocks import Metric
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import SOURCES
from space_robot_sim.environment.disturbance import DisturbanceSettings

Array = NDArray[np.float64]

SINES = "sines"
"""Name of the disturbance (61) among the sources."""


class DisturbanceBySource(Metric):
    """RMS, maximum and impulse of the torque of each source, about the common centre of mass.

    The impulse is the angular momentum that the source has given since the first tick, which
    wheels have to store if nothing unloads them.
    """

    def __init__(self, disturbance: DisturbanceSettings) -> None:
        """``disturbance``: of the flight."""
        self._disturbance = disturbance
        names = (*SOURCES, SINES) if disturbance.scale else SOURCES
        self._rows = 0
        self._squares, self._largest = (dict.fromkeys(names, 0.0) for _ in range(2))
        self._impulse = {name: np.zeros(3) for name in names}
        self._stored = dict.fromkeys(names, 0.0)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        self._rows += log.ticks
        for name, torque in torques_by_source(log, self._disturbance).items():
            square = np.sum(torque**2, axis=1)
            self._squares[name] += float(square.sum())
            self._largest[name] = max(self._largest[name], float(np.sqrt(square.max())))
            impulse = self._impulse[name] + log.timebase.period * np.cumsum(torque, axis=0)
            self._impulse[name] = impulse[-1].copy()
            longest = float(np.linalg.norm(impulse, axis=1).max())
            self._stored[name] = max(self._stored[name], longest)

    def result(self) -> dict[str, dict[str, float]]:
        """Return by source RMS and maximum, N m, and the largest impulse, N m s."""
        return {
            name: {
                "rms_n_m": float(np.sqrt(self._squares[name] / self._rows)),
                "max_n_m": self._largest[name],
                "impulse_n_m_s": self._stored[name],
            }
            for name in self._largest
        }


def torques_by_source(log: FlightLog, disturbance: DisturbanceSettings) -> dict[str, Array]:
    """Return the torque (N, 3) of each source over the interval after each tick, N m.

    Inertial axes, about the common centre of mass.
    """
    torques: dict[str, Any] = {
        name: log.external_torques[:, 3 * k : 3 * k + 3] for k, name in enumerate(SOURCES)
    }
    if disturbance.scale:
        waves = np.array(disturbance.base_frequencies)[:, np.newaxis] * (2.0 * np.pi * log.time)
        sine = -disturbance.scale * disturbance.base_amplitude * sines_cosines(waves)[0].sum(axis=0)
        torques[SINES] = np.repeat(sine[:, np.newaxis], 3, axis=1)
    return torques
