"""The Earth below the robots of a scene in orbit: a sphere with day and night, and its limb.

The sphere is a model at a distance that is large for the scene, with the right angular size. Its
colours are those of its vertices, so that it is one thing to draw, without textures and lights.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.orbit.elements import EARTH_RADIUS

from .glb import grid_faces, unlit_glb
from .orbit import OrbitFrames
from .scene import set_pose

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Tints = tuple[tuple[int, int, int], tuple[int, int, int]]

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


class Earth:
    """The Earth in a scene."""

    def __init__(
        self, scene: SceneApi, orbit: OrbitFrames, middle: Array, distance: float, dark: bool
    ) -> None:
        """Draw what is seen of it from an orbit.

        Args:
            scene: of a server.
            orbit: with the directions to Earth and Sun.
            middle: (3,) of the scene, m: there the Earth has its angular size.
            distance: of its centre where it is farthest, m.
            dark: whether the page is light on dark.
        """
        self._middle, self._step = middle, RESOLUTION * distance
        self._scale = distance / float(np.linalg.norm(orbit.position, axis=1).max())
        shades = ON_DARK_PAGE if dark else ON_LIGHT_PAGE
        self.node = scene.add_glb(
            "/earth", earth_glb(orbit, self._scale, shades), cast_shadow=False, receive_shadow=False
        )
        self.move(orbit.position[0])

    def move(self, position: Array) -> None:
        """Place it for the scene's position (3,) from the Earth's centre, m."""
        offset = np.round(self._scale * position / self._step) * self._step
        set_pose(self.node, "position", self._middle - offset)


def earth_glb(orbit: OrbitFrames, scale: float, shades: Shades) -> bytes:
    """Return the part of the Earth that is seen from an orbit, about its centre, as a GLB file.

    Args:
        orbit: with the directions to Earth and Sun.
        scale: of the model.
        shades: its colours.
    """
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
        np.concatenate([_mixed(_day(rays, orbit.sun), *tints) for _, rays, _, tints in layers]),
        np.concatenate([faces + first[k] for k, (_, _, faces, _) in enumerate(layers)]),
        lines + first[-2],
    )


def _day(directions: Array, sun: Array | None) -> Array:
    """Return from 0 to 1 how light it is on the ground at some places, (V,)."""
    if sun is None:
        return np.ones(len(directions))
    night, day = TWILIGHT
    height = directions @ sun
    x = np.clip((height - night) / (day - night), 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x) * (0.6 + 0.4 * np.clip(height, 0.0, 1.0)))


def _mixed(day: Array, by_day: tuple[int, ...], by_night: tuple[int, ...]) -> Array:
    dark, light = np.array(by_night) / 255.0, np.array(by_day) / 255.0
    mixed: Array = dark + day[:, np.newaxis] * (light - dark)
    return mixed


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
