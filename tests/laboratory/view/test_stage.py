"""The first camera sees all of a scene, whole and large."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scene_pages import EARTH_RADIUS, CircularOrbit

from space_robot.flight.plan import FlightPlan, resolve
from space_robot.view.base_surface import clearest_side
from space_robot.view.horizon import Horizon
from space_robot.view.local_server import local_server
from space_robot.view.orbit_frames import OrbitFrames
from space_robot.view.stage import DIRECTION, FIELD_OF_VIEW, LAMPS, SIDES, set_stage

Array = NDArray[np.float64]


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
        stage = set_stage(server, points, dark=False, horizon=Horizon.of(frames))
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


@pytest.mark.parametrize(("name", "side"), [("paper", 1.0), ("canadarm", -1.0), ("canadarm2", 1.0)])
def test_the_base_does_not_hide_the_arm(name: str, side: float) -> None:
    """It is on the other side of the Orbiter's z axis."""
    scenario = resolve(FlightPlan(robot=name, controller="ctc"))
    robot, waypoints = scenario.robots.plant, scenario.settings.mission.waypoints_deg
    poses = np.radians(np.reshape(waypoints, (-1, robot.n)))
    found = clearest_side([(robot, np.tile([1.0, 0.0, 0.0, 0.0], (len(poses), 1)), poses)])
    assert np.array_equal(found, SIDES[0]) is (side > 0.0)
    with local_server() as server:
        set_stage(server, random_points(1, 2.0), dark=True, side=found)
        camera = server.initial_camera
        back = np.array(camera.position) - np.array(camera.look_at)
    assert np.array_equal(np.sign(back), np.sign(DIRECTION * found))
    assert np.sign(found[2]) == side
