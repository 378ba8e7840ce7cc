"""Earth, Sun and shadow in a flight's orbit, how they are drawn, and what the camera sees."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.linalg import norm
from scene_pages import (
    EARTH_RADIUS,
    CircularOrbit,
    Scene,
    moving_log,
    orbiting_log,
    page_of,
    plot_data,
)
from scipy.spatial.transform import Rotation

from space_robot.flight.plan import Scenario, resolve
from space_robot.view.flights import Mark, ViewOptions, flight_marks
from space_robot.view.frames import shown_times
from space_robot.view.orbit import (
    ON_DARK_PAGE,
    OrbitFrames,
    Shades,
    earth_glb,
    shadow_intervals,
    sun_direction,
)
from space_robot.view.scene import local_server, turns_from_z
from space_robot.view.stage import DIRECTION, FIELD_OF_VIEW, LAMPS, SIDES, clearest_side, set_stage
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.parts import Visual
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import ORBIT_FIELDS

SECOND = 1_000_000_000
GRAY = Shades(((255,) * 3, (0,) * 3), ((9,) * 3, (9,) * 3), (((99,) * 3, (99,) * 3),) * 3)
"""The ground is white by day and black by night."""
CLOSE = np.radians(0.06)
"""Of the limb: two pixels of the first picture."""
NOON = CircularOrbit(beta=0.5)
DUSK = np.pi - np.arccos(np.sqrt(1.0 - (EARTH_RADIUS / NOON.radius) ** 2) / np.cos(NOON.beta))
"""Angle from noon at which the shadow begins, rad."""
EVENING = NOON._replace(start=float(DUSK) - 9.8 * NOON.rate)
"""Enters the shadow after 9.8 s."""
ARROWS = ("nadir", "orbital_velocity", "Sun")


class Earth(NamedTuple):
    """The parts of the Earth's GLB file, by trimesh."""

    vertices: Array
    colours: Array
    """Linear, of the vertices."""
    ground: Array
    """(F, 3, 3) triangles."""
    haze: Array
    circles: Array
    """(K, 3) points."""

    @classmethod
    def of(cls, data: bytes) -> Earth:
        surface = trimesh.load(io.BytesIO(data), "glb", process=False).geometry["GLTF"]
        heights = norm(surface.vertices, axis=1)[surface.faces[:, 0]]
        is_ground = heights < 1.000001 * heights.min()
        used = np.unique(surface.faces[is_ground])
        colours = surface.visual.vertex_attributes["color"][used, 0] / 65535.0
        return cls(
            np.asarray(surface.vertices[used]),
            np.asarray(colours),
            np.asarray(surface.triangles[is_ground]),
            np.asarray(surface.triangles[~is_ground]),
            np.delete(surface.vertices, surface.faces.ravel(), axis=0),
        )


def frames_of(orbit: CircularOrbit, times: Array, has_sun: bool = True) -> OrbitFrames:
    dark = np.zeros(len(times), bool)
    sun = orbit.sun if has_sun else None
    return OrbitFrames(orbit.position(times), orbit.velocity(times), sun, dark)


def test_the_frames_are_the_logs_rows_if_they_are_of_an_orbit(paper_robot: Robot) -> None:
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
    for column, numbers in (
        (log.orbit_position, [(0.0, 0.0, 0.0), (1e6, 0.0, 0.0), (1e300, 0.0, 0.0)]),
        (log.orbit_velocity, [(0.0, 0.0, 0.0)]),
    ):
        for wrong in numbers:
            before = column[5].copy()
            column[5] = wrong
            assert OrbitFrames.of(log, log.time) is None
            column[5] = before
    log.orbit_velocity[:] = np.nan
    plain = moving_log(paper_robot, 10)
    assert OrbitFrames.of(log, log.time) is OrbitFrames.of(plain, plain.time) is None
    assert shadow_intervals(plain) == []


def test_the_sun_is_unknown_without_sunlight_or_description(paper_robot: Robot) -> None:
    dark = orbiting_log(paper_robot, CircularOrbit(pressure=0.0), 10, SECOND)
    assert sun_direction(dark) is None
    silent = replace(orbiting_log(paper_robot, CircularOrbit(), 10, SECOND), flight={})
    assert sun_direction(silent) is None
    frames = OrbitFrames.of(silent, silent.time)
    assert frames is not None
    assert not frames.is_dark.any()


def test_an_orbits_shadow_lasts_as_long_as_its_geometry_says(paper_robot: Robot) -> None:
    """Dark is ``cos(beta) cos(u) < -sqrt(1 - (R / r)^2)``, u from noon."""
    orbit = CircularOrbit(beta=0.4, start=0.1)
    log = orbiting_log(paper_robot, orbit, int(2.0 * np.pi / orbit.rate), SECOND)
    half = np.arccos(np.sqrt(1.0 - (EARTH_RADIUS / orbit.radius) ** 2) / np.cos(orbit.beta))
    start, stop = ((np.pi + side * half - orbit.start) / orbit.rate for side in (-1, 1))
    ((dark_from, dark_to),) = shadow_intervals(log)
    assert (dark_from, dark_to) == (np.ceil(start), np.ceil(stop))
    assert flight_marks(log) == [Mark(dark_from, dark_to, "in the Earth's shadow", "shadow")]
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
    """``asin(R / r)`` from nadir, all around, wherever the robot is; the haze is seen beyond."""
    orbit = CircularOrbit(10.0**height, inclination, start)
    frames = frames_of(orbit, np.linspace(0.0, part * 2.0 * np.pi / orbit.rate, 40))
    earth = Earth.of(earth_glb(frames, 1e-3, ON_DARK_PAGE))
    np.testing.assert_allclose(norm(earth.vertices, axis=1), 1e-3 * EARTH_RADIUS, rtol=1e-6)
    expected = np.arcsin(EARTH_RADIUS / orbit.radius)
    for k in (0, 17, 39):
        seen = limb(earth.ground, 1e-3 * frames.position[k])
        assert np.all(seen < expected + 1e-6)
        assert np.all(seen > expected - (CLOSE if part < 0.1 else 4.0 * CLOSE))
    for triangles, side in ((earth.ground, 1.0), (earth.haze, -1.0)):
        a, b, c = triangles.transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        area = norm(normals, axis=1)
        real = area > 1e-9 * area.max()  # not those at the pole
        assert np.all(side * np.sum(normals * (a + b + c), axis=1)[real] > 0.0)
    assert norm(earth.haze, axis=2).min() > 1e-3 * EARTH_RADIUS
    assert np.all(limb(earth.haze, 1e-3 * frames.position[0]) > expected)


def test_day_is_where_the_sun_is_and_circles_are_of_right_ascension_and_declination() -> None:
    """In linear colours that no light changes."""
    orbit = CircularOrbit(beta=0.2)
    whole = np.linspace(0.0, 2.0 * np.pi / orbit.rate, 60)
    data = earth_glb(frames_of(orbit, whole), 1.0, GRAY)
    assert b"KHR_materials_unlit" in data
    earth = Earth.of(data)
    height = earth.vertices @ orbit.sun / EARTH_RADIUS
    assert np.all(earth.colours[height < -0.1] == 0.0)
    assert np.all(earth.colours[height > 0.3] > 0.3)
    assert np.all(np.diff(earth.colours[np.argsort(height)]) > -1e-3)  # lighter towards the Sun
    half = GRAY._replace(ground=((188,) * 3, (188,) * 3))
    unknown = Earth.of(earth_glb(frames_of(orbit, whole, has_sun=False), 1.0, half))
    np.testing.assert_allclose(unknown.colours, 0.5, atol=0.005)  # of the light: 188 of 255 in CSS
    x, y, z = earth.circles.T
    for_each = np.degrees([np.arcsin(z / np.sqrt(x * x + y * y + z * z)), np.arctan2(y, x)])
    off = np.abs(for_each - 10.0 * np.round(for_each / 10.0))
    assert np.all(off.min(axis=0) < 1e-3)
    assert len(earth.circles) > 60


def test_arrows_are_turned_from_z() -> None:
    directions = np.random.default_rng(1).normal(size=(50, 3))
    directions[:2] = [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]
    directions /= norm(directions, axis=1, keepdims=True)
    turns = Rotation.from_quat(turns_from_z(directions), scalar_first=True)
    np.testing.assert_allclose(turns.apply([0.0, 0.0, 1.0]), directions, atol=1e-12)


@pytest.fixture(scope="module")
def log(paper_robot: Robot) -> FlightLog:
    """A flight of 20 s that enters the shadow between two ticks; its base moves."""
    log = orbiting_log(paper_robot, EVENING, 41, SECOND // 2)
    log.base_position[:] = 0.01 * log.time[:, np.newaxis] * [1.0, 2.0, 3.0]
    log.magnetic_field[:] = [1e-5, 2e-5, 3e-5]
    log.external_torques[:, :3], log.external_torques[:, 9:] = [1e-3, 0.0, 0.0], [0.0, 0.0, 2e-6]
    return log


@pytest.fixture(scope="module")
def page(paper_robot: Robot, log: FlightLog) -> str:
    return page_of(paper_robot, one=log)


def test_the_earth_and_the_arrows_are_where_they_are_in_orbit(page: str, log: FlightLog) -> None:
    scene = Scene(page)
    up = log.orbit_position / norm(log.orbit_position, axis=1, keepdims=True)
    ahead = log.orbit_velocity / norm(log.orbit_velocity, axis=1, keepdims=True)
    for row in (0, 1, 20, 40):
        poses = scene.poses(log.time[row] + 1e-6)
        earth = poses["/earth"].position
        assert np.degrees(np.arccos(-up[row] @ earth / norm(earth))) < 0.1
        base = poses["/one/base_link"].position
        for name, direction in zip(ARROWS, (-up[row], ahead[row], EVENING.sun), strict=True):
            arrow = poses[f"/one/orbit/{name}/arrow"]
            np.testing.assert_allclose(arrow.rotation[:, 2], direction, atol=1e-7)
            np.testing.assert_allclose(arrow.position, base, atol=1e-8)


def test_legend_labels_and_the_shadow(page: str) -> None:
    names = [name.replace("_", " ") for name in ARROWS]
    assert re.findall(r'<span><i style="background: #\w+"></i>(.*?)</span>', page) == names
    scene = Scene(page)
    labels = {m["props"]["text"] for _, m in scene.messages if m["type"] == "LabelMessage"}
    assert set(names) < labels
    shadow = {"start": 10.0, "stop": None, "text": "in the Earth's shadow", "kind": "shadow"}
    assert plot_data(page)["marks"] == [shadow]
    ((time, intensity),) = [
        (time, message["updates"]["intensity"])
        for time, message in scene.messages
        if message["type"] == "SceneNodeUpdateMessage" and message["name"] == "/lamp_0"
    ]
    assert time == pytest.approx(10.0)
    assert intensity < 0.5


def test_the_torques_by_source_and_the_magnetic_field_are_plotted(page: str) -> None:
    """No air and no sunlight acted."""
    shown = {
        plot["title"]: [max(v for v in s["values"] if v is not None) for s in plot["series"]]
        for plot in plot_data(page)["plots"]
        if plot["title"].endswith(("torque", "field")) and plot["title"] != "base torque"
    }
    assert shown == {
        "gravity gradient torque": [1e-3, 0.0, 0.0],
        "magnetic torque": [0.0, 0.0, 2e-6],
        "magnetic field": [1e-5, 2e-5, 3e-5],
    }


def test_side_by_side_each_has_its_arrows_and_over_one_another_the_first(
    paper_robot: Robot, log: FlightLog
) -> None:
    logs = {"plain": moving_log(paper_robot, 41, period_ns=SECOND // 2), "one": log, "two": log}
    together = Scene(page_of(paper_robot, **logs)).names()
    assert {name for name in together if name.endswith("orbit")} == {"/one/orbit"}
    apart = Scene(page_of(paper_robot, ViewOptions(side_by_side=True), **logs))
    assert {n for n in apart.names() if n.endswith("orbit")} == {"/one/orbit", "/two/orbit"}
    poses = apart.poses(0.0)
    track = log.orbit_velocity[0] / norm(log.orbit_velocity[0])
    offset = poses["/two"].position - poses["/one"].position
    assert offset @ track > 1.0
    np.testing.assert_allclose(offset, (offset @ track) * track, atol=1e-9)


def test_a_flight_without_orbit_and_gears_has_nothing_of_them(
    paper_robot: Robot, log: FlightLog
) -> None:
    columns: dict[str, Any] = {name: np.empty((log.ticks, 0)) for name in ORBIT_FIELDS}
    page = page_of(paper_robot, one=replace(log, **columns))
    scene = Scene(page)
    assert not [n for n in scene.names() if "orbit" in n or n in ("/earth", "/sun")]
    assert not {m["type"] for _, m in scene.messages} & {"GlbMessage", "SceneNodeUpdateMessage"}
    titles = [plot["title"] for plot in plot_data(page)["plots"]]
    assert not [title for title in titles if title.startswith(("magnetic", "gravity", "gear"))]
    assert 'id="arrows"' not in page


def random_points(seed: int, size: float) -> Array:
    random = np.random.default_rng(seed)
    points: Array = random.uniform(-size, size, (20, 3)) + random.uniform(-9.0, 9.0, 3)
    return points


def seen_by(camera: Any, up: Array, points: Array) -> tuple[Array, Array]:
    """Right, up and ahead of the camera; how far aside, 1 at the edge, and how deep points are."""
    position, slope = np.array(camera.position), np.tan(0.5 * FIELD_OF_VIEW)
    forward = np.array(camera.look_at) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(right, forward), forward])
    x, y, depth = axes @ (points - position).T
    return axes, np.array([np.abs(x / depth / slope) / 1.1, np.abs(y / depth / slope), depth])


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 50.0))
def test_the_camera_sees_every_point_and_no_more_than_it_must(seed: int, size: float) -> None:
    points = random_points(seed, size)
    with local_server() as server:
        set_stage(server, points, dark=False)
        camera = server.initial_camera
        _, (wide, high, depth) = seen_by(camera, np.array([0.0, 0.0, 1.0]), points)
        target, near, far = np.array(camera.look_at), camera.near, camera.far
        back = np.array(camera.position) - target
    np.testing.assert_allclose(back / np.linalg.norm(back), DIRECTION / np.linalg.norm(DIRECTION))
    np.testing.assert_allclose(target, 0.5 * (points.min(axis=0) + points.max(axis=0)))
    assert 0.7 < max(high.max(), wide.max()) < 1.0
    assert 0.0 < near < depth.min() <= depth.max() < far


@settings(max_examples=10)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.1, 50.0),
    st.floats(300e3, 1200e3),
    st.floats(0.0, np.pi),
    st.floats(-np.pi, np.pi),
)
def test_in_orbit_the_camera_sees_every_point_and_the_earth_below(
    seed: int, size: float, height: float, inclination: float, start: float
) -> None:
    points = random_points(seed, size)
    orbit = CircularOrbit(height, inclination, start)
    now = np.zeros(1)
    frames = OrbitFrames(orbit.position(now), orbit.velocity(now), orbit.sun, np.zeros(1, bool))
    with local_server() as server:
        stage = set_stage(server, points, dark=False, orbit=frames)
        camera, lamp = server.initial_camera, stage.lamp
        up, far = np.array(camera.up), camera.far
        axes, (wide, high, depth) = seen_by(camera, up, points)
        np.testing.assert_allclose(np.array(camera.look_at), stage.middle)
        np.testing.assert_allclose(lamp.position, orbit.sun, atol=1e-12)
        bright = lamp.intensity
        stage.shade(True)
        assert 0.0 < lamp.intensity < 0.3 * bright
        stage.shade(False)
        assert lamp.intensity == bright == LAMPS[0][1]
    local_up = orbit.position(now)[0] / orbit.radius
    np.testing.assert_allclose(up, local_up, atol=1e-12)
    assert axes[0] @ orbit.velocity(now)[0] > 0.0  # it flies to the right
    assert np.all(depth > 0.0)
    assert max(high.max(), wide.max()) < 1.0
    # the limb, straight ahead, is in the lower half of the picture
    ahead = np.cross(local_up, axes[0])
    dip = np.arccos(EARTH_RADIUS / orbit.radius)
    limb = np.cos(dip) * ahead - np.sin(dip) * local_up
    _, above, away = axes @ limb
    assert -1.0 < above / away / np.tan(0.5 * FIELD_OF_VIEW) < -0.2
    assert far > 2.0 * stage.earth_distance > 5000.0 * stage.size


@pytest.mark.parametrize("turned_deg", [30.0, -30.0])
def test_the_camera_does_not_see_a_panel_from_its_edge(turned_deg: float) -> None:
    turn = Rotation.from_euler("z", turned_deg, degrees=True).as_matrix()
    wing = Visual("box", (3.0, 0.02, 1.0), turn)
    robot = replace(find_robot("paper"), visuals=(wing,))
    side = clearest_side([(robot, np.eye(4)[:1], np.zeros((1, robot.joint_count)))])
    back = DIRECTION * side / np.linalg.norm(DIRECTION)
    assert abs(back @ wing.rotation[:, 1]) > 0.9


@pytest.mark.parametrize(("name", "side"), [("paper", 1.0), ("canadarm", -1.0), ("canadarm2", 1.0)])
def test_the_base_does_not_hide_the_arm(name: str, side: float) -> None:
    """It is on the other side of the Orbiter's z axis."""
    scenario = resolve(Scenario(robot=name, controller="ctc"))
    robot, start = scenario.robots.plant, np.radians(scenario.mission.joints_deg)
    poses = np.array([start, *(piece.goal for piece in scenario.reference.pieces)])
    found = clearest_side([(robot, np.tile([1.0, 0.0, 0.0, 0.0], (len(poses), 1)), poses)])
    assert np.array_equal(found, SIDES[0]) is (side > 0.0)
    with local_server() as server:
        set_stage(server, random_points(1, 2.0), dark=True, side=found)
        camera = server.initial_camera
        back = np.array(camera.position) - np.array(camera.look_at)
    assert np.array_equal(np.sign(back), np.sign(DIRECTION * found))
    assert np.sign(found[2]) == side
