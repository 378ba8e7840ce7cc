"""Wheels that turn by SciPy's integral of their speeds, and plumes as long as the thrust."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from moving_logs import moving_log
from numpy.typing import NDArray
from scene_pages import Scene, page_of
from scipy.integrate import cumulative_trapezoid

from space_robot.view.flights import ViewOptions
from space_robot.view.plumes import SHORTEST, PlumeFrames
from space_robot.view.wheels import (
    FASTEST,
    LARGEST_TURN,
    SATURATED,
    STEP,
    WheelFrames,
    slowdown_of,
    wheel_places,
)
from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_model.hardware.wheels import WheelSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

Array = NDArray[np.float64]
PERIOD = Timebase(10_000_000)
WHEELS = WheelSettings(
    axes=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], max_torque=[2.0], max_momentum=[10.0], rotor_inertia=[0.1]
)


@given(st.floats(0.0, 1e4), st.floats(0.0, 10.0))
def test_a_drawn_wheel_neither_blurs_nor_seems_to_turn_back(speed: float, frame_s: float) -> None:
    slowdown = slowdown_of(speed, frame_s)
    drawn = speed / slowdown
    assert drawn <= FASTEST * (1.0 + 1e-12)
    assert drawn * frame_s <= LARGEST_TURN * (1.0 + 1e-12)
    mantissa = slowdown / 10.0 ** np.floor(np.log10(slowdown) + 1e-9)
    assert min(abs(mantissa - step) for step in (1.0, 2.0, 5.0)) < 1e-9
    if slowdown > 1.0:  # and is no slower than necessary
        assert max(drawn / FASTEST, drawn * frame_s / LARGEST_TURN) > 1.0 / 2.5 - 1e-9


def test_a_wheel_at_a_limit_between_two_frames_is_marked() -> None:
    log = FlightLog.allocate(31, (), PERIOD, wheels=2)
    log.wheel_velocities[:], log.wheel_torques[:] = 0.0, 0.0
    log.wheel_torques[13, 0] = -2.0  # the motor's largest
    log.wheel_velocities[25:, 1] = 100.0  # 10 N m s
    log.wheel_velocities[5] = np.nan
    frames = WheelFrames.of(log, WHEELS, np.array([0.0, 0.1, 0.2, 0.3]))
    assert frames.is_saturated[:, 0].tolist() == [False, False, True, False]
    assert frames.is_saturated[:, 1].tolist() == [False, False, False, True]
    assert np.isfinite(frames.angles).all()


def test_wheels_are_at_the_corners_and_those_of_one_axis_behind_one_another(
    paper_robot: Robot,
) -> None:
    axes = assumed_actuators("wheels", paper_robot).wheels.unit_axes
    places = wheel_places(paper_robot, axes)
    edge = np.sqrt(6.0 * 200.0 / 750.0) / 2.0
    away = np.linalg.norm(places, axis=1)
    np.testing.assert_allclose(places / away[:, np.newaxis], axes, atol=1e-12)
    assert (away > np.sqrt(3.0) * edge).all()
    assert (away < np.sqrt(3.0) * edge + 0.1).all()
    along_z = np.array([[0, 0, 1.0]] * 2 + [[0, 0, -1.0]])
    first, second, opposite = wheel_places(paper_robot, along_z)
    assert edge < first[2] < second[2]
    assert opposite[2] < -edge


def test_the_page_turns_the_wheels_and_colours_those_at_a_limit(paper_robot: Robot) -> None:
    """Four wheels with speeds at random, far from their limits but for one torque."""
    log = moving_log(paper_robot, 101, period_ns=PERIOD.period_ns)
    steps = np.random.default_rng(3).uniform(-1.0, 1.0, (101, 4))
    log.base_position[:] = 0.0
    log.wheel_velocities = 100.0 * steps.cumsum(axis=0) / 101
    log.wheel_torques = np.zeros((101, 4))
    log.wheel_torques[40:60, 2] = 4.0
    hardware = assumed_actuators("wheels", paper_robot)
    log.flight = {"base_actuators": hardware.model_dump(), "robot": paper_robot.name}
    page = page_of(paper_robot, one=log)
    scene = Scene(page)
    turned = cumulative_trapezoid(log.wheel_velocities, dx=0.01, axis=0, initial=0.0)
    slowdown = slowdown_of(float(np.abs(log.wheel_velocities).max()), 0.04)
    assert f"Wheels turn {slowdown:g} times slower than in flight" in page
    for row in (0, 30, 100):
        poses = scene.poses(0.01 * row + 1e-6)
        base = poses["/one/base_link"].rotation
        for wheel, axis in enumerate(hardware.wheels.unit_axes):
            frame = poses[f"/one/base_link/wheel_{wheel + 1}"].rotation
            rotor = poses[f"/one/base_link/wheel_{wheel + 1}/rotor"].rotation
            np.testing.assert_allclose(rotor[:, 2], base @ axis, atol=1e-3)
            inside = frame.T @ rotor  # about z
            away = np.arctan2(inside[1, 0], inside[0, 0]) - turned[row, wheel] / slowdown
            assert np.angle(np.exp(1j * away)) == pytest.approx(0.0, abs=4.0 * STEP)
    log.flight = {}  # without a description nothing is drawn
    names = Scene(page_of(paper_robot, one=log)).names()
    assert not [name for name in names if "wheel" in name]
    red = tuple(bytes.fromhex(SATURATED[1:]))
    colours = [
        (time, message["name"])
        for time, message in scene.messages
        if message["type"] == "SceneNodeUpdateMessage"
        and tuple(message["updates"].get("color", ())) == red
    ]
    assert [name for _, name in colours] == ["/one/base_link/wheel_3/rotor"]
    assert colours[0][0] == pytest.approx(0.4, abs=0.04)


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
    page = page_of(paper_robot, ViewOptions(rate=10.0), one=log)
    assert "the longest 4.5 N" in page
    scene, path = Scene(page), "/one/base_link/thruster_1/plume"
    log.flight = {}
    assert not [n for n in Scene(page_of(paper_robot, one=log)).names() if "thruster" in n]
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
