"""The Earth below: its angular size from the robot, its day and night, and what it costs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from glb_content import GlbContent
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.linalg import norm
from numpy.typing import NDArray
from orbiting_logs import EARTH_RADIUS, CircularOrbit

from space_robot.view.earth import ON_DARK_PAGE, Earth, Shades, earth_glb
from space_robot.view.orbit_frames import OrbitFrames

Array = NDArray[np.float64]
GRAY = Shades(((255,) * 3, (0,) * 3), ((9,) * 3, (9,) * 3), (((99,) * 3, (99,) * 3),) * 3)
"""The ground is white by day and black by night."""
CLOSE = np.radians(0.06)
"""Of the limb: two pixels of the first picture."""


class Ground:
    """The parts of the Earth's GLB file."""

    def __init__(self, data: bytes) -> None:
        content = GlbContent(data)
        radius = np.linalg.norm(content.vertices, axis=1)
        of_face = radius[content.faces[:, 0]]
        is_ground = of_face < 1.000001 * of_face.min()
        self.radius = float(of_face.min())
        self.faces = content.vertices[content.faces[is_ground]]
        self.haze = content.vertices[content.faces[~is_ground]]
        used = np.unique(content.faces[is_ground])
        self.vertices, self.colours = content.vertices[used], content.colours[used, 0]
        self.lines = content.vertices[content.lines]


def frames_of(orbit: CircularOrbit, times: Array, has_sun: bool = True) -> OrbitFrames:
    dark = np.zeros(len(times), bool)
    sun = orbit.sun if has_sun else None
    return OrbitFrames(orbit.position(times), orbit.velocity(times), sun, dark)


def limb(triangles: Array, eye: Array) -> Array:
    """Return the angle, rad, of the farthest triangles' corners from nadir, by 30 azimuths."""
    nadir = -eye / np.linalg.norm(eye)
    facing = np.sum(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        * (eye - triangles[:, 0]),
        axis=1,
    )
    rays = (triangles[facing > 0.0] - eye).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    aside = np.linalg.svd(nadir[np.newaxis])[2][1:]
    azimuth = np.arctan2(rays @ aside[0], rays @ aside[1])
    bins = ((azimuth + np.pi) / (2.0 * np.pi) * 30.0).astype(int) % 30
    angles = np.arccos(np.clip(rays @ nadir, -1.0, 1.0))
    return np.array([angles[bins == k].max() for k in range(30)])


@settings(max_examples=12)
@given(
    st.floats(5.4, 8.0),  # 250 km to 100,000 km
    st.floats(0.0, np.pi),
    st.floats(-np.pi, np.pi),
    st.sampled_from([0.001, 0.05, 0.3, 1.0]),
)
def test_the_limb_is_where_it_is_in_orbit(
    height: float, inclination: float, start: float, part: float
) -> None:
    """``asin(R / r)`` from nadir, all around, wherever the robot is in its flight."""
    orbit = CircularOrbit(10.0**height, inclination, start)
    times = np.linspace(0.0, part * 2.0 * np.pi / orbit.rate, 40)
    frames = frames_of(orbit, times)
    scale = 1e-3
    ground = Ground(earth_glb(frames, scale, ON_DARK_PAGE))
    assert ground.radius == pytest.approx(scale * EARTH_RADIUS)
    for k in (0, 17, 39):
        seen = limb(ground.faces, scale * frames.position[k])
        expected = np.arcsin(EARTH_RADIUS / orbit.radius)
        assert np.all(seen < expected + 1e-6)
        assert np.all(seen > expected - (CLOSE if part < 0.1 else 4.0 * CLOSE))


def test_the_ground_is_seen_from_outside_and_the_haze_only_beyond_the_limb() -> None:
    frames = frames_of(CircularOrbit(), np.array([0.0, 20.0]))
    ground = Ground(earth_glb(frames, 1.0, ON_DARK_PAGE))
    for triangles, side in ((ground.faces, 1.0), (ground.haze, -1.0)):
        a, b, c = triangles.transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        area = np.linalg.norm(normals, axis=1)
        outwards = np.sum(normals * (a + b + c), axis=1)
        real = area > 1e-9 * area.max()  # not those at the pole
        assert np.all(side * outwards[real] > 0.0)
    nadir, eye = -frames.up[0], frames.position[0]
    a, b, c = ground.haze.transpose(1, 0, 2)
    facing = np.sum(np.cross(b - a, c - a) * (eye - a), axis=1) > 0.0
    rays = ground.haze[facing].reshape(-1, 3) - eye
    angle = np.arccos(rays @ nadir / np.linalg.norm(rays, axis=1))
    distance, limb_at = np.linalg.norm(rays, axis=1), np.arcsin(EARTH_RADIUS / norm(eye))
    inside = angle < limb_at
    along, off = norm(eye) * np.cos(angle[inside]), norm(eye) * np.sin(angle[inside])
    ground_at = along - np.sqrt(EARTH_RADIUS**2 - off**2)
    assert np.all(distance[inside] > ground_at)  # the ground hides it
    assert angle.max() > limb_at + np.radians(0.5)


def test_it_is_day_where_the_sun_is_and_night_on_the_other_side() -> None:
    orbit = CircularOrbit(beta=0.2)
    whole = np.linspace(0.0, 2.0 * np.pi / orbit.rate, 60)
    ground = Ground(earth_glb(frames_of(orbit, whole), 1.0, GRAY))
    height = ground.vertices @ orbit.sun / EARTH_RADIUS
    assert np.all(ground.colours[height < -0.1] == 0.0)
    assert np.all(ground.colours[height > 0.3] > 0.3)
    order = np.argsort(height)
    assert np.all(np.diff(ground.colours[order]) > -1e-3)  # lighter towards the Sun
    unknown = Ground(earth_glb(frames_of(orbit, whole, has_sun=False), 1.0, GRAY))
    assert np.all(unknown.colours == unknown.colours[0])


def test_the_circles_are_of_right_ascension_and_declination() -> None:
    ground = Ground(earth_glb(frames_of(CircularOrbit(), np.array([0.0, 20.0])), 1.0, GRAY))
    x, y, z = ground.lines.reshape(-1, 3).T
    declination = np.degrees(np.arcsin(z / np.sqrt(x * x + y * y + z * z)))
    right_ascension = np.degrees(np.arctan2(y, x))
    off = [
        np.abs(angle - 10.0 * np.round(angle / 10.0)) for angle in (declination, right_ascension)
    ]
    assert np.all(np.minimum(*off) < 1e-3)
    assert len(ground.lines) > 30


class FakeScene:
    """Keeps the node that is added."""

    def add_glb(self, path: str, data: bytes, **options: Any) -> Any:
        self.path, self.data, self.options = path, data, options

        class Node:
            position = np.zeros(3)

        return Node()


def test_it_moves_as_the_robot_flies_and_throws_no_shadow() -> None:
    orbit, scene = CircularOrbit(20e6), FakeScene()
    frames = frames_of(orbit, np.linspace(0.0, 600.0, 50))
    middle = np.array([1.0, -2.0, 3.0])
    shown: Any = scene
    earth = Earth(shown, frames, middle, 15e3, True)
    assert (scene.path, scene.options) == (
        "/earth",
        {"cast_shadow": False, "receive_shadow": False},
    )
    for k in (0, 20, 49):
        earth.move(frames.position[k])
        offset = np.asarray(earth.node.position) - middle
        assert np.linalg.norm(offset) == pytest.approx(15e3, rel=1e-5)
        np.testing.assert_allclose(offset / np.linalg.norm(offset), -frames.up[k], atol=2e-6)


@pytest.mark.parametrize(("part", "most"), [(0.004, 500_000), (1.0, 1_500_000)])
def test_it_is_cheap_to_draw(part: float, most: int) -> None:
    """Before compression; of a flight of 20 s, and of a whole orbit."""
    orbit = CircularOrbit()
    times = np.linspace(0.0, part * 2.0 * np.pi / orbit.rate, 100)
    data = earth_glb(frames_of(orbit, times), 1.0, ON_DARK_PAGE)
    assert len(data) < most
    ground = Ground(data)
    assert len(ground.faces) + len(ground.haze) < 100_000
