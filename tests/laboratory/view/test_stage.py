"""The first camera sees all of a scene, whole and large."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.view.stage import DIRECTION, FIELD_OF_VIEW, set_stage

viser = pytest.importorskip("viser")


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 50.0))
def test_the_camera_sees_every_point_and_no_more_than_it_must(seed: int, size: float) -> None:
    random = np.random.default_rng(seed)
    points = random.uniform(-size, size, (20, 3)) + random.uniform(-9.0, 9.0, 3)
    server = viser.ViserServer(port=0, verbose=False)
    try:
        set_stage(server, points, dark=False, shadows=False)
        camera = server.initial_camera
        position, target = np.array(camera.position), np.array(camera.look_at)
    finally:
        server.stop()
    back = position - target
    assert np.allclose(np.cross(back, DIRECTION), 0.0, atol=1e-9 * np.linalg.norm(back))
    assert back @ DIRECTION > 0.0
    np.testing.assert_allclose(target, 0.5 * (points.min(axis=0) + points.max(axis=0)))
    forward = -back / np.linalg.norm(back)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    depth = (points - position) @ forward
    slope = np.tan(0.5 * FIELD_OF_VIEW)
    high = np.abs((points - position) @ up) / depth / slope
    wide = np.abs((points - position) @ right) / depth / slope / 1.1
    assert np.all(depth > 0.0)
    assert 0.7 < max(high.max(), wide.max()) < 1.0
    assert camera.near < depth.min()
    assert depth.max() < camera.far
