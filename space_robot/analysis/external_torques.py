"""Torques on the robot from outside, by source: of the orbit, the sines of (61), the user's own."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import cross, to_inertial
from space_robot_msgs_py.bag.flight_log import FlightLog, Metric
from space_robot_msgs_py.samples import SOURCES
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.loads import LoadSchedule

from .base_demand import axes_of

Array = NDArray[np.float64]

SINES = "sines"
"""Name of the disturbance (61) among the sources."""
OWN = "own"
"""Name of the user's own disturbance among them."""


class DisturbanceBySource(Metric):
    """RMS, maximum and impulse of the torque of each source, about the common centre of mass.

    The impulse is the angular momentum that the source has given since the first tick, which
    wheels have to store if nothing unloads them.
    """

    def __init__(self, disturbance: DisturbanceSettings, captures: Captures | None = None) -> None:
        """Prepare the sources of a flight.

        Args:
            disturbance: of the flight.
            captures: of its robot; needed if the disturbance has a table.
        """
        self._disturbance, self._captures = disturbance, captures
        names = (
            *SOURCES,
            *((SINES,) if disturbance.scale else ()),
            *((OWN,) if disturbance.table else ()),
        )
        self._rows = 0
        self._squares, self._largest = (dict.fromkeys(names, 0.0) for _ in range(2))
        self._impulse = {name: np.zeros(3) for name in names}
        self._stored = dict.fromkeys(names, 0.0)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        self._rows += log.ticks
        for name, torque in torques_by_source(log, self._disturbance, self._captures).items():
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


def torques_by_source(
    log: FlightLog, disturbance: DisturbanceSettings, captures: Captures | None = None
) -> dict[str, Array]:
    """Return the torque (N, 3) of each source over the interval after each tick, N m.

    Inertial axes, about the common centre of mass; ``captures`` as in `DisturbanceBySource`.
    """
    torques: dict[str, Any] = {
        name: log.external_torques[:, 3 * k : 3 * k + 3] for k, name in enumerate(SOURCES)
    }
    if disturbance.scale:
        waves = np.array(disturbance.base_frequencies)[:, np.newaxis] * (2.0 * np.pi * log.time)
        sine = -disturbance.scale * disturbance.base_amplitude * np.sin(waves).sum(axis=0)
        torques[SINES] = np.repeat(sine[:, np.newaxis], 3, axis=1)
    if disturbance.table and captures is not None:
        torques[OWN] = _own_torque(log, disturbance, captures)
    return torques


def base_loads(log: FlightLog, disturbance: DisturbanceSettings) -> tuple[Array, Array]:
    """Return force and torque (N, 6) of the user's own disturbance on the base, base frame.

    At the begin and at the end of the interval after each tick, N and N m.
    """
    schedule = LoadSchedule.of(disturbance, log.joint_names, log.timebase.period)
    begin, end = schedule.over(np.arange(log.first_tick, log.first_tick + log.ticks))
    return begin[:, :6], end[:, :6]


def torque_about_centre(axes: Array, centre_of_mass: Array, force: Array, torque: Array) -> Array:
    """Return the torque (N, 3) about the common centre of mass, inertial axes, N m.

    Args:
        axes: (3, 3, N) of the base, see `base_axes`.
        centre_of_mass: (N, 3) from that of the base, inertial axes, m.
        force: (N, 3) at the base's centre of mass, base frame, N.
        torque: (N, 3) on the base, base frame, N m.
    """
    pushed, turned = to_inertial(axes, force.T), to_inertial(axes, torque.T)
    return (turned - cross(centre_of_mass.T, pushed)).T


def _own_torque(log: FlightLog, disturbance: DisturbanceSettings, captures: Captures) -> Array:
    loads, stop = base_loads(log, disturbance)[0], log.first_tick + log.ticks
    ticks = [log.first_tick, *captures.ticks(log.first_tick + 1, stop), stop]
    centres = []
    for begin, end in pairwise(ticks):  # between captures and releases the robot is the same
        rows = log.rows(begin - log.first_tick, end - log.first_tick)
        centres.append(_centre_of_mass(captures.robot_at(begin), rows))
    return torque_about_centre(axes_of(log), np.concatenate(centres), loads[:, :3], loads[:, 3:])


def _centre_of_mass(robot: Robot, log: FlightLog) -> Array:
    """Return the common centre of mass (N, 3) from the base's, inertial axes, m."""
    quaternion = unit_rows(log.quaternion)
    motion = Motion(quaternion, log.omega_base, log.all_positions, log.all_velocities)
    return robot_momentum(robot, motion).centre_of_mass
