"""The Earth, the Sun's light and arrows in the live scene of a flight in orbit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_model.orbit.elements import state_of
from space_robot_model.robot import Robot
from space_robot_sim.environment.orbit import OrbitSettings

from ..arrows import ArrowSize, BaseArrows, arrow_directions, arrow_kinds
from ..earth import Earth
from ..horizon import Horizon
from ..orbit_frames import OrbitFrames, is_in_shadow
from ..stage import Stage

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]

EVERY_DEG = 10.0
"""Mean anomalies of the places of an orbit from which the Earth is drawn."""


def whole_orbit(settings: OrbitSettings, first: Array) -> OrbitFrames:
    """Return a revolution in the shadow of nothing, so that the Earth can be drawn for all of it.

    Args:
        settings: with an orbit.
        first: (6,) position, m, and velocity, m/s, of its first frame.
    """
    places = [first]
    for anomaly in np.arange(-180.0, 180.0, EVERY_DEG):
        elements = settings.orbital_elements.model_copy(update={"anomaly_deg": float(anomaly)})
        places.append(np.concatenate(state_of(elements)))
    position, velocity = np.hsplit(np.array(places), 2)
    sun = settings.sun if settings.sunlight.pressure > 0.0 else None
    return OrbitFrames(position, velocity, sun, np.zeros(len(places), bool))


class LiveOrbit:
    """What the scene shows of an orbit."""

    def __init__(
        self, settings: OrbitSettings, orbit: Array, robot: Robot, seen: Array, dark: bool
    ) -> None:
        """Prepare it.

        Args:
            settings: with an orbit.
            orbit: (6,) of the first sample.
            robot: of the flight.
            seen: (K, 3) points of the robot in its first pose, m.
            dark: whether the page is light on dark.
        """
        self._orbit, self._dark = whole_orbit(settings, orbit), dark
        self.horizon = Horizon.of(self._orbit)
        self._size = ArrowSize.of(robot, seen)

    def draw(self, scene: SceneApi, stage: Stage, root: str) -> None:
        """Draw it; call it once.

        Args:
            scene: of a server.
            stage: of the scene.
            root: name of the robot in the scene.
        """
        self._stage = stage
        self._earth = Earth(scene, self._orbit, stage.middle, stage.earth_distance, self._dark)
        kinds = arrow_kinds(self._orbit.sun is not None, self._dark)
        self._arrows = BaseArrows(scene, root, self._size, kinds)

    def move(self, base: Array, orbit: Array) -> None:
        """Move it.

        Args:
            base: (3,) position of the base, m, inertial frame.
            orbit: (6,) position, m, and velocity, m/s, of the inertial frame's origin.
        """
        position, sun = orbit[:3], self._orbit.sun
        self._earth.move(position)
        self._stage.shade(bool(is_in_shadow((position + base)[np.newaxis], sun)[0]))
        self._arrows.move(base, arrow_directions(position, orbit[3:], sun))

    def close(self) -> None:
        """Remove what is not below the robot."""
        self._earth.node.remove()
