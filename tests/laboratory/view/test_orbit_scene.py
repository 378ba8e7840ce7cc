"""Earth, Sun and shadow in a flight's orbit, and how the Earth and arrows are drawn."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from moving_logs import EARTH_RADIUS, CircularOrbit, moving_log, orbiting_log
from numpy.linalg import norm
from numpy.typing import NDArray
from paths import CONFIG
from scipy.spatial.transform import Rotation

from space_robot.view.arrows import ArrowSize, BaseArrows, arrow_directions, arrow_kinds
from space_robot.view.earth import ON_DARK_PAGE, Earth, Shades, earth_glb
from space_robot.view.frames import shown_times
from space_robot.view.marks import Mark, marks_of
from space_robot.view.orbit_frames import OrbitFrames, shadow_intervals, sun_direction
from space_robot_model.robot import Robot

Array = NDArray[np.float64]
SECOND = 1_000_000_000
GRAY = Shades(((255,) * 3, (0,) * 3), ((9,) * 3, (9,) * 3), (((99,) * 3, (99,) * 3),) * 3)
"""The ground is white by day and black by night."""
CLOSE = np.radians(0.06)
"""Of the limb: two pixels of the first picture."""
Z = np.array([0.0, 0.0, 1.0])
DIRECTIONS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: norm(v) > 0.1)
TYPES = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
COLUMNS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class EarthFile:
    """The parts of the Earth's GLB file, read as the standard of glTF 2.0 says."""

    def __init__(self, data: bytes) -> None:
        assert struct.unpack("<4sII", data[:12]) == (b"glTF", 2, len(data))
        size, kind = struct.unpack("<I4s", data[12:20])
        assert kind == b"JSON"
        self.document: dict[str, Any] = json.loads(data[20 : 20 + size])
        assert struct.unpack("<I4s", data[20 + size : 28 + size])[1] == b"BIN\0"
        self._data = data[28 + size :]
        parts = {p["mode"]: p for p in self.document["meshes"][0]["primitives"]}
        attributes = parts[4]["attributes"]
        vertices: Array = self._numbers(attributes["POSITION"]).astype(np.float64)
        faces = self._numbers(parts[4]["indices"]).reshape(-1, 3)
        self.lines = vertices[self._numbers(parts[1]["indices"]).reshape(-1, 2)]
        of_face = norm(vertices, axis=1)[faces[:, 0]]
        self.radius = float(of_face.min())
        is_ground = of_face < 1.000001 * self.radius
        self.faces, self.haze = vertices[faces[is_ground]], vertices[faces[~is_ground]]
        used = np.unique(faces[is_ground])
        colours = self._numbers(attributes["COLOR_0"])[:, 0] / 65535.0
        self.vertices, self.colours = vertices[used], colours[used]

    def _numbers(self, accessor: int) -> NDArray[Any]:
        held = self.document["accessors"][accessor]
        view = self.document["bufferViews"][held["bufferView"]]
        part = self._data[view["byteOffset"] :][: view["byteLength"]]
        numbers = np.frombuffer(part, TYPES[held["componentType"]])
        return numbers.reshape(held["count"], COLUMNS[held["type"]])


def frames_of(orbit: CircularOrbit, times: Array, has_sun: bool = True) -> OrbitFrames:
    dark = np.zeros(len(times), bool)
    sun = orbit.sun if has_sun else None
    return OrbitFrames(orbit.position(times), orbit.velocity(times), sun, dark)


def test_the_frames_are_the_logs_rows(paper_robot: Robot) -> None:
    orbit = CircularOrbit(start=0.3)
    log = orbiting_log(paper_robot, orbit, 50, SECOND)
    log.orbit_velocity[7] = np.nan
    frames = OrbitFrames.of(log, shown_times([log], 1.0))
    assert frames
    rows = np.arange(50)
    rows[7] = 6  # held
    np.testing.assert_array_equal(frames.position, orbit.position(1.0 * rows))
    np.testing.assert_array_equal(frames.velocity, orbit.velocity(1.0 * rows))
    assert frames.sun is not None
    np.testing.assert_allclose(frames.sun, orbit.sun, atol=1e-14)
    assert not frames.is_dark.any()


@pytest.mark.parametrize("row", [0, 5])
@pytest.mark.parametrize("numbers", [(0.0, 0.0, 0.0), (1e6, 0.0, 0.0), (1e300, 0.0, 0.0)])
def test_numbers_of_no_orbit(paper_robot: Robot, row: int, numbers: tuple[float, ...]) -> None:
    log = orbiting_log(paper_robot, CircularOrbit(), 10, SECOND)
    log.orbit_position[row] = numbers
    assert OrbitFrames.of(log, log.time) is None
    fallen = orbiting_log(paper_robot, CircularOrbit(), 10, SECOND)
    fallen.orbit_velocity[row] = 0.0
    assert OrbitFrames.of(fallen, fallen.time) is None
    fallen.orbit_velocity[:] = np.nan
    assert OrbitFrames.of(fallen, fallen.time) is None
    plain = moving_log(paper_robot, 10)
    assert OrbitFrames.of(plain, plain.time) is None
    assert shadow_intervals(plain) == []


def test_the_sun_is_unknown_without_sunlight_or_description(
    paper_robot: Robot, tmp_path: Path
) -> None:
    """An older bag may have the name of an orbit's file alone, read only if it is trusted."""
    dark = orbiting_log(paper_robot, CircularOrbit(pressure=0.0), 10, SECOND)
    assert sun_direction(dark) is None
    silent = replace(orbiting_log(paper_robot, CircularOrbit(), 10, SECOND), flight={})
    assert sun_direction(silent) is None
    frames = OrbitFrames.of(silent, silent.time)
    assert frames is not None
    assert not frames.is_dark.any()
    file = tmp_path / "orbit.yaml"
    file.write_text((CONFIG / "orbits" / "iss.yaml").read_text())
    named = replace(silent, flight={"robot": "paper", "case": "1", "orbit": str(file)})
    assert sun_direction(named) is not None
    assert sun_direction(replace(named, trusted=False)) is None
    named.flight["orbit"] = "iss"
    assert sun_direction(replace(named, trusted=False)) is not None


def test_an_orbits_shadow_lasts_as_long_as_its_geometry_says(paper_robot: Robot) -> None:
    """Dark is ``cos(beta) cos(u) < -sqrt(1 - (R / r)^2)``, u from noon."""
    orbit = CircularOrbit(beta=0.4, start=0.1)
    log = orbiting_log(paper_robot, orbit, int(2.0 * np.pi / orbit.rate), SECOND)
    half = np.arccos(np.sqrt(1.0 - (EARTH_RADIUS / orbit.radius) ** 2) / np.cos(orbit.beta))
    start, stop = ((np.pi + side * half - orbit.start) / orbit.rate for side in (-1, 1))
    ((dark_from, dark_to),) = shadow_intervals(log)
    assert (dark_from, dark_to) == (np.ceil(start), np.ceil(stop))
    assert marks_of(log) == [Mark(dark_from, dark_to, "in the Earth's shadow", "shadow")]
    middle = int(0.5 * (start + stop))
    assert shadow_intervals(log.rows(middle, middle + 10)) == [(middle, np.inf)]
    frames = OrbitFrames.of(log, log.time)
    assert frames
    np.testing.assert_array_equal(frames.is_dark, (log.time >= dark_from) & (log.time < dark_to))
    log.orbit_position[middle] = np.nan  # unknown is not dark
    assert len(shadow_intervals(log)) == 2


def limb(triangles: Array, eye: Array) -> Array:
    """Return the angle, rad, of the farthest triangles' corners from nadir, by 30 azimuths."""
    nadir = -eye / norm(eye)
    a, b, c = triangles.transpose(1, 0, 2)
    facing = np.sum(np.cross(b - a, c - a) * (eye - a), axis=1)
    rays = (triangles[facing > 0.0] - eye).reshape(-1, 3)
    rays /= norm(rays, axis=1, keepdims=True)
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
    frames = frames_of(orbit, np.linspace(0.0, part * 2.0 * np.pi / orbit.rate, 40))
    earth = EarthFile(earth_glb(frames, 1e-3, ON_DARK_PAGE))
    assert earth.radius == pytest.approx(1e-3 * EARTH_RADIUS)
    for k in (0, 17, 39):
        seen = limb(earth.faces, 1e-3 * frames.position[k])
        expected = np.arcsin(EARTH_RADIUS / orbit.radius)
        assert np.all(seen < expected + 1e-6)
        assert np.all(seen > expected - (CLOSE if part < 0.1 else 4.0 * CLOSE))


def test_the_ground_is_seen_from_outside_and_the_haze_only_beyond_the_limb() -> None:
    frames = frames_of(CircularOrbit(), np.array([0.0, 20.0]))
    earth = EarthFile(earth_glb(frames, 1.0, ON_DARK_PAGE))
    for triangles, side in ((earth.faces, 1.0), (earth.haze, -1.0)):
        a, b, c = triangles.transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        area = norm(normals, axis=1)
        outwards = np.sum(normals * (a + b + c), axis=1)
        real = area > 1e-9 * area.max()  # not those at the pole
        assert np.all(side * outwards[real] > 0.0)
    nadir, eye = -frames.up[0], frames.position[0]
    a, b, c = earth.haze.transpose(1, 0, 2)
    facing = np.sum(np.cross(b - a, c - a) * (eye - a), axis=1) > 0.0
    rays = earth.haze[facing].reshape(-1, 3) - eye
    angle = np.arccos(rays @ nadir / norm(rays, axis=1))
    distance, limb_at = norm(rays, axis=1), np.arcsin(EARTH_RADIUS / norm(eye))
    inside = angle < limb_at
    along, off = norm(eye) * np.cos(angle[inside]), norm(eye) * np.sin(angle[inside])
    ground_at = along - np.sqrt(EARTH_RADIUS**2 - off**2)
    assert np.all(distance[inside] > ground_at)  # the ground hides it
    assert angle.max() > limb_at + np.radians(0.5)


def test_day_is_where_the_sun_is_and_circles_are_of_right_ascension_and_declination() -> None:
    """In linear colours that no light changes."""
    orbit = CircularOrbit(beta=0.2)
    whole = np.linspace(0.0, 2.0 * np.pi / orbit.rate, 60)
    earth = EarthFile(earth_glb(frames_of(orbit, whole), 1.0, GRAY))
    height = earth.vertices @ orbit.sun / EARTH_RADIUS
    assert np.all(earth.colours[height < -0.1] == 0.0)
    assert np.all(earth.colours[height > 0.3] > 0.3)
    assert np.all(np.diff(earth.colours[np.argsort(height)]) > -1e-3)  # lighter towards the Sun
    assert earth.document["materials"] == [{"extensions": {"KHR_materials_unlit": {}}}]
    half = GRAY._replace(ground=((188,) * 3, (188,) * 3))
    unknown = EarthFile(earth_glb(frames_of(orbit, whole, has_sun=False), 1.0, half))
    np.testing.assert_allclose(unknown.colours, 0.5, atol=0.005)  # of the light: 188 of 255 in CSS
    x, y, z = earth.lines.reshape(-1, 3).T
    for_each = np.degrees([np.arcsin(z / np.sqrt(x * x + y * y + z * z)), np.arctan2(y, x)])
    off = np.abs(for_each - 10.0 * np.round(for_each / 10.0))
    assert np.all(off.min(axis=0) < 1e-3)
    assert len(earth.lines) > 30


class FakeScene:
    """Keeps the nodes that are added."""

    def __init__(self) -> None:
        self.nodes: dict[str, Any] = {}

    def add_frame(self, path: str, **_: object) -> Any:
        self.nodes[path] = SimpleNamespace(position=np.zeros(3), wxyz=np.array([1.0, 0, 0, 0]))
        return self.nodes[path]

    def add_label(self, path: str, text: str, position: tuple[float, ...]) -> None:
        self.nodes[path] = SimpleNamespace(text=text, position=position)

    def add_glb(self, path: str, data: bytes, **options: Any) -> Any:
        self.nodes[path] = SimpleNamespace(position=np.zeros(3), options=options)
        return self.nodes[path]


def test_the_earth_moves_as_the_robot_flies_and_throws_no_shadow() -> None:
    orbit = CircularOrbit(20e6)
    shown: Any = FakeScene()
    frames = frames_of(orbit, np.linspace(0.0, 600.0, 50))
    middle = np.array([1.0, -2.0, 3.0])
    earth = Earth(shown, frames, middle, 15e3, True)
    assert shown.nodes["/earth"].options == {"cast_shadow": False, "receive_shadow": False}
    for k in (0, 20, 49):
        earth.move(frames.position[k])
        offset = np.asarray(earth.node.position) - middle
        assert norm(offset) == pytest.approx(15e3, rel=1e-5)
        np.testing.assert_allclose(offset / norm(offset), -frames.up[k], atol=2e-6)


@given(st.lists(st.one_of(DIRECTIONS, st.just((0.0, 0.0, -1.0))), min_size=3, max_size=3))
def test_arrows_stand_at_the_base_point_to_their_directions_and_have_labels(
    vectors: list[tuple[float, ...]],
) -> None:
    position, velocity, sun = (np.array(v) for v in vectors)
    sun /= norm(sun)
    scene: Any = FakeScene()
    arrows = BaseArrows(scene, "/one", ArrowSize(1.5, 4.0), arrow_kinds(True, True))
    base = np.array([0.1, 0.2, 0.3])
    arrows.move(base, arrow_directions(5e6 * position, 4e3 * velocity, sun))
    np.testing.assert_array_equal(scene.nodes["/one/orbit"].position, base)
    expected = {"nadir": -position / norm(position), "orbital_velocity": velocity / norm(velocity)}
    for name, direction in {**expected, "Sun": sun}.items():
        turn = Rotation.from_quat(scene.nodes[f"/one/orbit/{name}"].wxyz, scalar_first=True)
        np.testing.assert_allclose(turn.apply(Z), direction, atol=1e-6)
        label = scene.nodes[f"/one/orbit/{name}/label"]
        assert label.text == name.replace("_", " ")
        assert label.position[2] > 1.5
    assert len(arrow_directions(position, velocity, None)) == 2
