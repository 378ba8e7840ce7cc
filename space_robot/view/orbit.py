"""The orbit of a flight: where Earth and Sun are, and arrows to them at the robot's base."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.orbit.elements import EARTH_RADIUS
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.described import plant_settings
from .extent import base_reach
from .frames import Frames, held_rows, rounded
from .glb import revolved_glb
from .scene import palette, rgb, set_pose, turns_from_z

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

COLUMNS = ("orbit_position", "orbit_velocity")
FARTHEST, FASTEST = 1e11, 1e9
"""Largest position, m, and velocity, m/s, that are shown."""
BEYOND = 0.16
"""Length of arrows beyond the base, relative to the size of the robot."""
SHAFT, HEAD, TIP = 0.004, 0.012, 0.036
"""Radius of the shaft, and radius and length of the head, relative to the size of the robot."""
SIDES = 16
COLOURS = (2, 5, 4)
"""Places of the arrows' colours in the palette; flights have the first ones."""


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
        settings = plant_settings(log)
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


class ArrowKind(NamedTuple):
    """A direction that is shown."""

    name: str
    colour: str
    """Such as ``#E69F00``."""


def arrow_kinds(has_sun: bool, dark: bool) -> list[ArrowKind]:
    """Return nadir, orbital velocity and, if its direction is known, the Sun."""
    colours = palette(dark)
    names = ("nadir", "orbital velocity", "Sun") if has_sun else ("nadir", "orbital velocity")
    return [ArrowKind(name, colours[k]) for name, k in zip(names, COLOURS, strict=False)]


class OrbitArrows:
    """Arrows at the base of a flight in orbit."""

    def __init__(self, robot: Robot, frames: Frames, orbit: OrbitFrames, seen: Array) -> None:
        """Choose their size.

        Args:
            robot: that flew.
            frames: of its flight.
            orbit: of its flight.
            seen: (K, 3) points of the robot in some poses, m.
        """
        self._base, self._orbit = frames.base_position, orbit
        self._size = float(np.ptp(seen, axis=0).max())
        self._length = base_reach(robot) + BEYOND * self._size

    def _directions(self, k: int) -> Array:
        """Return the unit vectors (A, 3) of the arrows, in the order of `arrow_kinds`."""
        orbit = self._orbit
        sun = [] if orbit.sun is None else [orbit.sun]
        return unit_rows(np.array([-orbit.position[k], orbit.velocity[k], *sun]))

    @property
    def tips(self) -> Array:
        """(A, 3) of the arrows in the first frame, m, inertial frame."""
        tips: Array = self._base[0] + self._length * self._directions(0)
        return tips

    def add(self, scene: SceneApi, root: str, dark: bool) -> Callable[[int], None]:
        """Draw them below a robot's name in the scene; return what moves them to a frame."""
        base = scene.add_frame(f"{root}/orbit", show_axes=False)
        radii = self._size * np.array([0.0, SHAFT, SHAFT, HEAD, 0.0])
        neck = self._length - TIP * self._size
        heights = np.array([0.0, 0.0, neck, neck, self._length])
        nodes = []
        for kind in arrow_kinds(self._orbit.sun is not None, dark):
            path = f"{root}/orbit/{kind.name.replace(' ', '_')}"
            nodes.append(scene.add_frame(path, show_axes=False))
            # light does not change the colour, which is that of the legend
            colours = np.tile(np.array(rgb(kind.colour)) / 255.0, (len(radii), 1))
            arrow = revolved_glb(radii, heights, colours, SIDES)
            scene.add_glb(f"{path}/arrow", arrow, cast_shadow=False, receive_shadow=False)
            end = self._length + 0.5 * HEAD * self._size
            scene.add_label(f"{path}/label", kind.name, position=(0.0, 0.0, end))

        def move(k: int) -> None:
            set_pose(base, "position", self._base[k])
            turns = rounded(turns_from_z(self._directions(k)))
            for node, turn in zip(nodes, turns, strict=True):
                set_pose(node, "wxyz", turn)

        return move
