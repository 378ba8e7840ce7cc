"""How a scene in orbit is seen first: with the Earth below."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.orbit.elements import EARTH_RADIUS

from .orbit_frames import OrbitFrames

Array = NDArray[np.float64]

LIMB = 0.6
"""Distance of the Earth's limb below the middle of the first picture, relative to half of it."""
STEEPEST = np.radians(30.0)
"""Largest elevation of the initial camera in orbit."""


class Horizon(NamedTuple):
    """Directions in a scene in orbit, at its first frame."""

    axes: Array
    """(3, 3) columns along the track, the orbit's normal and up, inertial axes."""
    dip: float
    """Angle of the Earth's limb below the horizontal, rad."""
    sun: Array | None
    """(3,) unit vector to the Sun; None: unknown."""

    @classmethod
    def of(cls, orbit: OrbitFrames) -> Horizon:
        """Return the one of an orbit's first frame."""
        up, velocity = orbit.up[0], orbit.velocity[0]
        normal = np.cross(up, velocity)
        normal /= np.linalg.norm(normal)
        axes = np.column_stack([np.cross(normal, up), normal, up])
        distance = float(np.linalg.norm(orbit.position[0]))
        return cls(axes, float(np.arccos(EARTH_RADIUS / distance)), orbit.sun)

    def camera_direction(self, direction: Array, field_of_view: float) -> Array:
        """Return the direction (3,) from the robots to the initial camera, on `axes`.

        Args:
            direction: (3,) without the Earth, whose x and y are kept.
            field_of_view: vertical, rad; the limb is in its lower half.
        """
        elevation = np.clip(self.dip - LIMB * 0.5 * field_of_view, 0.0, STEEPEST)
        aside = direction[:2] / np.linalg.norm(direction[:2])
        return np.array([*np.cos(elevation) * aside, np.sin(elevation)])
