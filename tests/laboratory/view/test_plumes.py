"""Plumes of thrusters: as long as the thrust is large, at their places, against the force."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from moving_logs import moving_log
from numpy.typing import NDArray
from scene_pages import Scene

from space_robot.view.flights import ViewOptions, flights_page
from space_robot.view.plumes import SHORTEST, PlumeFrames
from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

pytest.importorskip("viser")

Array = NDArray[np.float64]


def quiet(total: int):  # type: ignore[no-untyped-def]
    return lambda: None


def test_between_two_frames_the_mean_thrust_counts() -> None:
    """So that a pulse that is shorter than a frame is seen, and impulse is neither lost nor won."""
    log = FlightLog.allocate(101, (), Timebase(1_000_000), thrusters=3)
    log.thrusts[:] = np.random.default_rng(1).uniform(size=(101, 3))
    log.thrusts[7] = np.nan
    rows = [0, 10, 35, 100]
    thrusts = PlumeFrames.of(log, 1e-3 * np.array(rows)).thrusts
    known = np.nan_to_num(log.thrusts)
    np.testing.assert_array_equal(thrusts[0], known[0])
    for k, (start, stop) in enumerate(pairwise(rows)):
        np.testing.assert_allclose(thrusts[k + 1], known[start + 1 : stop + 1].mean(axis=0))


def test_the_plume_is_in_proportion_to_the_thrust_and_against_the_force(paper_robot: Robot) -> None:
    hardware = assumed_actuators("thrusters", paper_robot)
    thrusters = hardware.thrusters
    log = moving_log(paper_robot, 11, period_ns=100_000_000)
    log.thrusts = np.zeros((11, thrusters.count))
    log.thrusts[3:6, 0] = [1.5, 4.5, 3.0]
    log.flight = {"base_actuators": hardware.model_dump(), "robot": paper_robot.name}
    page = flights_page({"one": log}, {"one": paper_robot}, ViewOptions(rate=10.0), quiet)
    assert "the longest 4.5 N" in page
    scene = Scene(page)
    path = "/one/base_link/thruster_1/plume"
    lengths = [
        (round(10.0 * time), tuple(message["updates"]["scale"]))
        for time, message in scene.messages
        if message.get("name") == path and "scale" in message.get("updates", {})
    ]
    assert [(row, scale[:2]) for row, scale in lengths] == [(k, (1.0, 1.0)) for k in (3, 4, 5)]
    shares = [scale[2] for _, scale in lengths]
    np.testing.assert_allclose(shares, np.array([1.5, 4.5, 3.0]) / 4.5, atol=0.5 * SHORTEST)
    for time in 0.1 * np.arange(11):
        shown = scene.visible(time + 1e-3)
        assert shown[path] == (0.3 - 1e-9 <= time < 0.6 - 1e-9), time
        assert not shown["/one/base_link/thruster_2/plume"]
    poses = scene.poses(0.3 + 1e-3)
    base = poses["/one/base_link"]
    for number, (place, force) in enumerate(
        zip(thrusters.places, thrusters.unit_directions, strict=True)
    ):
        nozzle = poses[f"/one/base_link/thruster_{number + 1}/nozzle"]
        at = base.position + base.rotation @ (paper_robot.com[0] + place)
        np.testing.assert_allclose(nozzle.position, at, atol=1e-6)
        np.testing.assert_allclose(nozzle.rotation[:, 2], -base.rotation @ force, atol=1e-6)


def test_without_a_description_nothing_is_drawn(paper_robot: Robot) -> None:
    log = moving_log(paper_robot, 5)
    log.thrusts, log.wheel_velocities = np.ones((5, 12)), np.ones((5, 4))
    log.wheel_torques = np.ones((5, 4))
    page = flights_page({"one": log}, {"one": paper_robot}, ViewOptions(), quiet)
    assert not [name for name in Scene(page).names() if "thruster" in name or "wheel" in name]
