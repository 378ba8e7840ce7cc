"""The orbit of a flight, sampled for a page: where the Earth and the Sun are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.orbit.elements import EARTH_RADIUS
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.described import orbit_of
from .frames import held_rows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

COLUMNS = ("orbit_position", "orbit_velocity")
FARTHEST, FASTEST = 1e11, 1e9
"""Largest position, m, and velocity, m/s, that are shown."""


@dataclass(frozen=True)
class OrbitFrames:
    """The orbit of a robot at K times, inertial axes."""

    position: Array
    """(K, 3) of the scene's origin from the Earth's centre, m."""
    velocity: Array
    """(K, 3) of the same, m/s."""
    sun: Array | None
    """(3,) unit vector to the Sun; None: the flight has no sunlight, or does not tell."""
    is_dark: Mask
    """(K,) whether the robot is in the Earth's shadow."""

    @classmethod
    def of(cls, log: FlightLog, times: Array) -> OrbitFrames | None:
        """Sample a flight; between ticks, and after its end, the last row is held.

        Args:
            log: the flight.
            times: (K,) s.

        Returns:
            None for a flight that is not in orbit, or whose bag has what no orbit is.
        """
        if not is_in_orbit(log) or not len(rows := held_rows(log, COLUMNS, times)):
            return None
        position, velocity = log.orbit_position[rows], log.orbit_velocity[rows]
        if not _are_of_orbit(position, velocity):
            return None
        sun = sun_direction(log)
        return cls(
            position,
            velocity,
            sun,
            is_in_shadow(position + np.nan_to_num(log.base_position[rows]), sun),
        )

    @property
    def up(self) -> Array:
        """(K, 3) unit vectors away from the Earth's centre."""
        return unit_rows(self.position)


def _are_of_orbit(position: Array, velocity: Array) -> bool:
    """Return True if positions and velocities, (K, 3), have all directions that are shown."""
    if np.abs(position).max() > FARTHEST or np.abs(velocity).max() > FASTEST:
        return False
    falls = ~np.cross(position, velocity).any(axis=1)
    return not falls.any() and bool(np.linalg.norm(position, axis=1).min() >= EARTH_RADIUS)


def is_in_orbit(log: FlightLog) -> bool:
    """Return True if a flight has the columns of an orbit."""
    return bool(log.orbit_position.shape[1])


def sun_direction(log: FlightLog) -> Array | None:
    """Return the unit vector (3,) to the Sun; None: no sunlight acts, or the bag does not tell."""
    try:
        settings = orbit_of(log)
    except InputError:
        return None
    return settings.sun if settings.has_orbit and settings.sunlight.pressure > 0.0 else None


def is_in_shadow(position: Array, sun: Array | None) -> Mask:
    """Return whether positions are in the Earth's shadow, a cylinder as in the simulation.

    Args:
        position: (K, 3) from the Earth's centre, m.
        sun: (3,) unit vector to the Sun; None: nothing is in a shadow.
    """
    if sun is None:
        return np.zeros(len(position), bool)
    along = position @ sun
    off = np.linalg.norm(position - along[:, np.newaxis] * sun, axis=1)
    return np.asarray((along < 0.0) & (off < EARTH_RADIUS))


def shadow_intervals(log: FlightLog) -> list[tuple[float, float]]:
    """Return start and stop, s, of a flight's times in the Earth's shadow.

    The stop of one that lasts until the end of the log is infinite.
    """
    if not is_in_orbit(log):
        return []
    # the comparison with NaN is false: unknown rows are in the light
    dark = is_in_shadow(log.orbit_position + log.base_position, sun_direction(log))
    edges = np.flatnonzero(np.diff(np.concatenate(([False], dark, [False])).astype(np.int8)))
    times = np.append(np.round(log.time, 9), np.inf)[edges]
    return [(float(start), float(stop)) for start, stop in times.reshape(-1, 2)]
