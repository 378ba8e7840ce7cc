"""What moves in the scene of a recorded flight in orbit: the Earth, the Sun's light, and arrows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot

from .arrows import ArrowSize, BaseArrows, arrow_directions, arrow_kinds
from .earth import Earth
from .frames import Frames
from .orbit_frames import OrbitFrames
from .stage import Stage
from .trails import Move

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]


def earth_frames(scene: SceneApi, stage: Stage, orbit: OrbitFrames, dark: bool) -> Move:
    """Draw the Earth.

    Args:
        scene: of a server.
        stage: of the scene.
        orbit: of a flight.
        dark: whether the page is light on dark.

    Returns:
        Moves the Earth to a frame of the flight, and dims the Sun's light in its shadow.
    """
    earth = Earth(scene, orbit, stage.middle, stage.earth_distance, dark)

    def move(k: int) -> None:
        earth.move(orbit.position[k])
        stage.shade(bool(orbit.is_dark[k]))

    return move


class ArrowFrames:
    """Arrows at the base of a flight in orbit."""

    def __init__(
        self, robot: Robot, frames: Frames, orbit: OrbitFrames, seen: Array, dark: bool
    ) -> None:
        """Choose their size.

        Args:
            robot: that flew.
            frames: of its flight.
            orbit: of its flight.
            seen: (K, 3) points of the robot in some poses, m.
            dark: whether the page is light on dark.
        """
        self._base, self._orbit = frames.base_position, orbit
        self._size = ArrowSize.of(robot, seen)
        self._kinds = arrow_kinds(orbit.sun is not None, dark)

    def _directions(self, k: int) -> Array:
        orbit = self._orbit
        return arrow_directions(orbit.position[k], orbit.velocity[k], orbit.sun)

    @property
    def tips(self) -> Array:
        """(A, 3) of the arrows in the first frame, m, inertial frame."""
        tips: Array = self._base[0] + self._size.length * self._directions(0)
        return tips

    def add(self, scene: SceneApi, root: str) -> Move:
        """Draw them; returns what moves them to a frame.

        Args:
            scene: of a server.
            root: name of the robot in the scene.
        """
        arrows = BaseArrows(scene, root, self._size, self._kinds)
        return lambda k: arrows.move(self._base[k], self._directions(k))
