"""The orbit of a flight in a scene: the Earth with day and night, and arrows at the robot's base.

The Earth is a model at a distance that is large for the scene, with the right angular size. Its
colours are those of its vertices, so that it is one thing to draw, without textures and lights.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import Array, unit_rows
from space_robot_model.orbit.elements import EARTH_RADIUS
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.described import plant_settings
from .frames import Frames, Move, held_rows, rounded
from .meshes import grid_faces, revolved_glb, unlit_glb
from .scene import palette, rgb, set_pose, turns_from_z
from .shapes import base_reach

if TYPE_CHECKING:
    from viser import SceneApi

Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]
Tints = tuple[tuple[int, int, int], tuple[int, int, int]]

COLUMNS = ("orbit_position", "orbit_velocity")
FARTHEST, FASTEST = 1e11, 1e9
"""Largest position, m, and velocity, m/s, that are shown."""
ARROWS = {"nadir": 2, "orbital velocity": 5, "Sun": 4}
"""Directions that are shown, with the places of their colours in the palette; flights have the
first ones."""
BEYOND = 0.16
"""Length of arrows beyond the base, relative to the size of the robot."""
SHAFT, HEAD, TIP, SIDES = 0.004, 0.012, 0.036, 16
"""Radius of the shaft, radius and length of the head, relative to the size of the robot; facets."""
RESOLUTION = 2.0**-20
"""Resolution of the Earth's position relative to its distance: 1e-6 rad."""
FINE, COARSE = np.radians(1.5), np.radians(3.0)
"""Largest edges of triangles, as seen from the Earth's centre, of a part of the Earth, and of a
large part: their chords are 0.5 km and 2.2 km inside of the sphere."""
LARGE = np.radians(60.0)
MARGIN = np.radians(2.0)
"""Of the part that is drawn beyond the horizon."""
HAZE = (9e3, 22e3, 42e3)
"""Heights of the atmosphere's layers beyond the limb, m."""
EVERY = 10
"""Degrees between the circles of declination and right ascension on the Earth."""
ABOVE = 2e3
"""Height of the circles, m, so that they are not in the ground."""
TWILIGHT = (-0.10, 0.25)
"""Sine of the Sun's elevation at which it is night and day."""


@dataclass(frozen=True)
class OrbitFrames:
    """The orbit of a robot at K times, inertial axes."""

    position: Array
    """(K, 3) of the scene's origin from the Earth's centre, m."""
    velocity: Array
    """(K, 3) of the same, m/s."""
    sun: Array | None
    """(3,) unit vector to the Sun; None: the flight has no sunlight, or does not say."""
    is_dark: Mask
    """(K,) whether the robot is in the Earth's shadow."""

    @classmethod
    def of(cls, log: FlightLog, times: Array) -> OrbitFrames | None:
        """Sample a flight at ``times`` (K,), s; between ticks, and after its end, a row is held.

        None for a flight that is not in orbit, or whose bag has what no orbit is.
        """
        if not is_in_orbit(log) or not len(rows := held_rows(log, COLUMNS, times)):
            return None
        position, velocity = log.orbit_position[rows], log.orbit_velocity[rows]
        if np.abs(position).max() > FARTHEST or np.abs(velocity).max() > FASTEST:
            return None
        falls = ~np.cross(position, velocity).any(axis=1)
        if falls.any() or np.linalg.norm(position, axis=1).min() < EARTH_RADIUS:
            return None
        sun = sun_direction(log)
        is_dark = is_in_shadow(position + np.nan_to_num(log.base_position[rows]), sun)
        return cls(position, velocity, sun, is_dark)

    @property
    def up(self) -> Array:
        """(K, 3) unit vectors away from the Earth's centre."""
        return unit_rows(self.position)

    @property
    def axes(self) -> Array:
        """(3, 3) columns along the track, the orbit's normal and up, in the first frame."""
        up = self.up[0]
        normal = np.cross(up, self.velocity[0])
        normal /= np.linalg.norm(normal)
        return np.column_stack([np.cross(normal, up), normal, up])

    @property
    def dip(self) -> float:
        """Angle of the Earth's limb below the horizontal in the first frame, rad."""
        return float(np.arccos(EARTH_RADIUS / np.linalg.norm(self.position[0])))


def is_in_orbit(log: FlightLog) -> bool:
    """Return True if a flight has the columns of an orbit."""
    return bool(log.orbit_position.shape[1])


def sun_direction(log: FlightLog) -> Array | None:
    """Return the unit vector (3,) to the Sun; None: no sunlight acts, or the bag does not say."""
    try:
        settings = plant_settings(log)
    except InputError:
        return None
    return settings.sun if settings.has_orbit and settings.sunlight.pressure > 0.0 else None


def is_in_shadow(position: Array, sun: Array | None) -> Mask:
    """Return whether positions (K, 3), m, from the Earth's centre are in its shadow.

    It is a cylinder, as in the simulation; without a unit vector (3,) to the Sun there is none.
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


def arrow_colours(has_sun: bool, dark: bool) -> dict[str, str]:
    """Return the colours, such as ``#E69F00``, of the shown `ARROWS`: the Sun's if it is known."""
    colours = palette(dark)
    return {name: colours[k] for name, k in ARROWS.items() if has_sun or name != "Sun"}


class OrbitArrows:
    """Arrows at the base of a flight in orbit."""

    def __init__(self, robot: Robot, frames: Frames, orbit: OrbitFrames, seen: Array) -> None:
        """Choose their size; ``seen`` (K, 3), m, are points of the robot in some poses."""
        self._base, self._orbit = frames.base_position, orbit
        self._size = float(np.ptp(seen, axis=0).max())
        self._length = base_reach(robot) + BEYOND * self._size

    def _directions(self, k: int) -> Array:
        """Return the unit vectors (A, 3) of the arrows, in the order of `ARROWS`."""
        orbit = self._orbit
        sun = [] if orbit.sun is None else [orbit.sun]
        return unit_rows(np.array([-orbit.position[k], orbit.velocity[k], *sun]))

    @property
    def tips(self) -> Array:
        """(A, 3) of the arrows in the first frame, m, inertial frame."""
        tips: Array = self._base[0] + self._length * self._directions(0)
        return tips

    def add(self, scene: SceneApi, root: str, dark: bool) -> Move:
        """Draw them below a robot's name in the scene; return what moves them to a frame."""
        base = scene.add_frame(f"{root}/orbit", show_axes=False)
        radii = self._size * np.array([0.0, SHAFT, SHAFT, HEAD, 0.0])
        neck = self._length - TIP * self._size
        heights = np.array([0.0, 0.0, neck, neck, self._length])
        end = self._length + 0.5 * HEAD * self._size
        nodes = []
        for name, colour in arrow_colours(self._orbit.sun is not None, dark).items():
            path = f"{root}/orbit/{name.replace(' ', '_')}"
            nodes.append(scene.add_frame(path, show_axes=False))
            # light does not change the colour, which is that of the legend
            colours = np.tile(np.array(rgb(colour)) / 255.0, (len(radii), 1))
            arrow = revolved_glb(radii, heights, colours, SIDES)
            scene.add_glb(f"{path}/arrow", arrow, cast_shadow=False, receive_shadow=False)
            scene.add_label(f"{path}/label", name, position=(0.0, 0.0, end))

        def move(k: int) -> None:
            set_pose(base, "position", self._base[k])
            turns = rounded(turns_from_z(self._directions(k)))
            for node, turn in zip(nodes, turns, strict=True):
                set_pose(node, "wxyz", turn)

        return move


class Shades(NamedTuple):
    """Colours of the Earth, red, green and blue from 0 to 255, by day and by night."""

    ground: Tints
    lines: Tints
    haze: tuple[Tints, ...]
    """Of the layers of `HAZE`."""


ON_DARK_PAGE = Shades(
    ((38, 92, 158), (9, 13, 22)),
    ((74, 132, 196), (22, 30, 44)),
    (
        ((190, 226, 255), (44, 62, 92)),
        ((104, 162, 226), (30, 42, 64)),
        ((44, 78, 128), (23, 28, 37)),
    ),
)
ON_LIGHT_PAGE = Shades(
    ((140, 186, 228), (70, 84, 108)),
    ((178, 210, 240), (96, 110, 134)),
    (
        ((206, 228, 250), (130, 146, 172)),
        ((222, 236, 252), (168, 180, 200)),
        ((240, 246, 254), (220, 226, 234)),
    ),
)


def add_earth(
    scene: SceneApi, orbit: OrbitFrames, middle: Array, distance: float, dark: bool
) -> Move:
    """Draw what is seen of the Earth from an orbit; return what moves it to a frame.

    Around the ``middle`` (3,) of the scene, m, it has its angular size; its centre is at most at
    the ``distance``, m.
    """
    scale = distance / float(np.linalg.norm(orbit.position, axis=1).max())
    surface = earth_glb(orbit, scale, ON_DARK_PAGE if dark else ON_LIGHT_PAGE)
    node = scene.add_glb("/earth", surface, cast_shadow=False, receive_shadow=False)
    step = RESOLUTION * distance

    def move(k: int) -> None:
        offset = np.round(scale * orbit.position[k] / step) * step
        set_pose(node, "position", middle - offset)

    return move


def earth_glb(orbit: OrbitFrames, scale: float, shades: Shades) -> bytes:
    """Return the part of the Earth that is seen from an orbit, about its centre, as a GLB file."""
    up = orbit.up
    pole = np.sum(up, axis=0)
    pole = pole / np.linalg.norm(pole) if np.linalg.norm(pole) > 1e-3 * len(up) else up[0]
    spread = float(np.arccos(np.clip(up @ pole, -1.0, 1.0)).max())
    distances = np.linalg.norm(orbit.position, axis=1)
    nearest, farthest = np.arccos(EARTH_RADIUS / np.array([distances.min(), distances.max()]))
    behind = np.arccos(EARTH_RADIUS / (EARTH_RADIUS + HAZE[-1]))  # of the farthest haze
    end = min(spread + float(farthest + behind) + MARGIN, np.pi)
    ground, haze = _belt(pole, 0.0, end), _belt(pole, max(0.0, nearest - spread - MARGIN), end)
    circles, lines = _circles(pole, end)
    layers = [
        (EARTH_RADIUS, *ground, shades.ground),
        # its faces look inwards, so that it is only seen beyond the limb
        *(
            (EARTH_RADIUS + height, haze[0], haze[1][:, ::-1], colours)
            for height, colours in zip(HAZE, shades.haze, strict=True)
        ),
        (EARTH_RADIUS + ABOVE, circles, np.empty((0, 3), np.int64), shades.lines),
    ]
    first = np.cumsum([0, *(len(rays) for _, rays, _, _ in layers)])
    return unlit_glb(
        scale * np.concatenate([radius * rays for radius, rays, _, _ in layers]),
        np.concatenate([_colours(rays, orbit.sun, *tints) for _, rays, _, tints in layers]),
        np.concatenate([faces + first[k] for k, (_, _, faces, _) in enumerate(layers)]),
        lines + first[-2],
    )


def _colours(
    directions: Array, sun: Array | None, by_day: tuple[int, ...], by_night: tuple[int, ...]
) -> Array:
    """Return colours from 0 to 1 at some places on the ground, (V, 3)."""
    light = np.ones(len(directions))
    if sun is not None:
        night, day = TWILIGHT
        height = directions @ sun
        x = np.clip((height - night) / (day - night), 0.0, 1.0)
        light = x * x * (3.0 - 2.0 * x) * (0.6 + 0.4 * np.clip(height, 0.0, 1.0))
    darkest, lightest = np.array(by_night) / 255.0, np.array(by_day) / 255.0
    return np.asarray(darkest + light[:, np.newaxis] * (lightest - darkest))


def _belt(pole: Array, start: float, end: float) -> tuple[Array, Indices]:
    """Return unit vectors (V, 3) between two angles from ``pole``, rad, and triangles (F, 3)."""
    edge = COARSE if end > LARGE else FINE
    rings, parts = int(np.ceil((end - start) / edge)), int(np.ceil(2.0 * np.pi / edge))
    theta = np.linspace(start, end, rings + 1)[:, np.newaxis, np.newaxis]
    phi = np.arange(parts)[:, np.newaxis] * (2.0 * np.pi / parts)
    aside = unit_rows(np.cross(pole, np.eye(3)[np.argmin(np.abs(pole))])[np.newaxis])[0]
    around = np.cos(phi) * aside + np.sin(phi) * np.cross(pole, aside)
    vertices = np.sin(theta) * around + np.cos(theta) * pole
    return vertices.reshape(-1, 3), grid_faces(rings + 1, parts)


def _circles(pole: Array, angle: float) -> tuple[Array, Indices]:
    """Return unit vectors (V, 3) and lines (L, 2): circles on the Earth around ``pole``."""
    along = np.radians(np.arange(0, 361, 2))
    ends = np.radians(np.arange(EVERY - 90, 91 - EVERY, 2))
    lines = [_places(np.full(len(along), d), along) for d in np.radians(np.arange(-80, 81, EVERY))]
    lines += [_places(ends, np.full(len(ends), r)) for r in np.radians(np.arange(0, 360, EVERY))]
    segments = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    seen = segments[(segments @ pole > np.cos(angle)).all(axis=1)]
    return seen.reshape(-1, 3), np.arange(2 * len(seen)).reshape(-1, 2)


def _places(declination: Array, right_ascension: Array) -> Array:
    across = np.cos(declination)
    columns = (across * np.cos(right_ascension), across * np.sin(right_ascension))
    return np.column_stack([*columns, np.sin(declination)])
