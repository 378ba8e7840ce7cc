"""The page of a flight in orbit, read from the page alone; without an orbit nothing is added."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from moving_logs import EARTH_RADIUS, CircularOrbit, moving_log, orbiting_log
from scene_pages import Scene, page_of, plot_data

from space_robot.view.flights import ViewOptions
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import ORBIT_WIDTHS, FlightLog

SECOND = 1_000_000_000
NOON = CircularOrbit(beta=0.5)
DUSK = np.pi - np.arccos(np.sqrt(1.0 - (EARTH_RADIUS / NOON.radius) ** 2) / np.cos(NOON.beta))
"""Angle from noon at which the shadow begins, rad."""
EVENING = NOON._replace(start=float(DUSK) - 9.8 * NOON.rate)
"""Enters the shadow after 9.8 s."""
ARROWS = ("nadir", "orbital_velocity", "Sun")


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
    up = log.orbit_position / np.linalg.norm(log.orbit_position, axis=1, keepdims=True)
    ahead = log.orbit_velocity / np.linalg.norm(log.orbit_velocity, axis=1, keepdims=True)
    for row in (0, 1, 20, 40):
        poses = scene.poses(log.time[row] + 1e-6)
        earth = poses["/earth"].position
        assert np.degrees(np.arccos(-up[row] @ earth / np.linalg.norm(earth))) < 0.1
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
    assert "--shadow:" in page
    ((time, intensity),) = [
        (time, message["updates"]["intensity"])
        for time, message in scene.messages
        if message["type"] == "SceneNodeUpdateMessage" and message["name"] == "/lamp_0"
    ]
    assert time == pytest.approx(10.0)
    assert intensity < 0.5


def test_the_torques_by_source_and_the_magnetic_field_are_plotted(page: str) -> None:
    plots = {plot["title"]: plot for plot in plot_data(page)["plots"]}
    assert [title for title in plots if title.endswith(("torque", "field"))] == [
        "base torque",
        "gravity gradient torque",
        "magnetic torque",
        "magnetic field",
    ]  # no air and no sunlight acted
    for title, unit, largest in (
        ("gravity gradient torque", "N m", [1e-3, 0.0, 0.0]),
        ("magnetic torque", "N m", [0.0, 0.0, 2e-6]),
        ("magnetic field", "T", [1e-5, 2e-5, 3e-5]),
    ):
        series = plots[title]["series"]
        assert [max(v for v in s["values"] if v is not None) for s in series] == largest
        assert plots[title]["unit"] == unit


def test_side_by_side_each_has_its_arrows_and_over_one_another_the_first(
    paper_robot: Robot, log: FlightLog
) -> None:
    logs = {"plain": moving_log(paper_robot, 41, period_ns=SECOND // 2), "one": log, "two": log}
    together = Scene(page_of(paper_robot, **logs)).names()
    assert {name for name in together if name.endswith("orbit")} == {"/one/orbit"}
    apart = Scene(page_of(paper_robot, ViewOptions(side_by_side=True), **logs))
    assert {n for n in apart.names() if n.endswith("orbit")} == {"/one/orbit", "/two/orbit"}
    poses = apart.poses(0.0)
    track = log.orbit_velocity[0] / np.linalg.norm(log.orbit_velocity[0])
    offset = poses["/two"].position - poses["/one"].position
    assert offset @ track > 1.0
    np.testing.assert_allclose(offset, (offset @ track) * track, atol=1e-9)


def test_a_flight_without_orbit_and_gears_has_nothing_of_them(
    paper_robot: Robot, log: FlightLog
) -> None:
    columns: dict[str, Any] = {name: np.empty((log.ticks, 0)) for name in ORBIT_WIDTHS}
    page = page_of(paper_robot, one=replace(log, **columns))
    scene = Scene(page)
    assert {name for name in scene.names() if not name.startswith(("/one/", "/inertial/"))} == {
        *("/one", "/inertial", "/stars", "/sky", "/lamp_0", "/lamp_1", "/WorldAxes")
    }
    assert not any("orbit" in name for name in scene.names())
    types = {message["type"] for _, message in scene.messages}
    assert not types & {"GlbMessage", "SceneNodeUpdateMessage"}
    assert [plot["title"] for plot in plot_data(page)["plots"] if plot["shown"]] == [
        "attitude error",
        "joints 1-3 error",
        "joints 4-6 error",
        "base drift",
        "base torque",
        "torque 1-3",
        "torque 4-6",
    ]
    assert "--shadow" not in page
    assert 'id="arrows"' not in page
