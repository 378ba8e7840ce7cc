"""Wheels that turn: SciPy's integral of their speeds, and their places outside of the base."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from moving_logs import moving_log
from numpy.typing import NDArray
from scene_pages import Scene
from scipy.integrate import cumulative_trapezoid

from space_robot.view.flights import ViewOptions, flights_page
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

pytest.importorskip("viser")

Array = NDArray[np.float64]
PERIOD = Timebase(10_000_000)
WHEELS = WheelSettings(
    axes=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], max_torque=[2.0], max_momentum=[10.0], rotor_inertia=[0.1]
)


def wheeled(robot: Robot, ticks: int) -> FlightLog:
    """A flight with the speeds of four wheels at random, far from their limits."""
    log, rng = moving_log(robot, ticks, period_ns=PERIOD.period_ns), np.random.default_rng(3)
    log.base_position[:] = 0.0
    log.wheel_velocities = 100.0 * rng.uniform(-1.0, 1.0, (ticks, 4)).cumsum(axis=0) / ticks
    log.wheel_torques = np.zeros((ticks, 4))
    hardware = assumed_actuators("wheels", robot)
    log.flight = {"base_actuators": hardware.model_dump(), "robot": robot.name}
    return log


def quiet(total: int):  # type: ignore[no-untyped-def]
    return lambda: None


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


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 200), st.integers(1, 20))
def test_the_angle_is_the_integral_of_the_speed(ticks: int, every: int) -> None:
    rng = np.random.default_rng(ticks)
    log = FlightLog.allocate(ticks, (), PERIOD, wheels=2)
    log.wheel_velocities[:] = rng.normal(size=(ticks, 2))
    log.wheel_torques[:] = 0.0
    times = 0.01 * np.arange(0, ticks, every)
    frames = WheelFrames.of(log, WHEELS, times)
    turned = cumulative_trapezoid(log.wheel_velocities, dx=0.01, axis=0, initial=0.0)
    np.testing.assert_allclose(frames.slowdown * frames.angles, turned[::every], atol=1e-12)


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
    first, second, opposite = wheel_places(
        paper_robot, np.array([[0, 0, 1.0]] * 2 + [[0, 0, -1.0]])
    )
    assert edge < first[2] < second[2]
    assert opposite[2] < -edge


def test_the_page_turns_the_wheels_and_colours_those_at_a_limit(paper_robot: Robot) -> None:
    log = wheeled(paper_robot, 101)
    log.wheel_torques[40:60, 2] = 4.0
    page = flights_page({"one": log}, {"one": paper_robot}, ViewOptions(), quiet)
    scene = Scene(page)
    turned = cumulative_trapezoid(log.wheel_velocities, dx=0.01, axis=0, initial=0.0)
    speed = np.abs(log.wheel_velocities).max()
    slowdown = slowdown_of(float(speed), 0.04)
    assert f"Wheels turn {slowdown:g} times slower than in flight" in page
    axes = assumed_actuators("wheels", paper_robot).wheels.unit_axes
    for row in (0, 30, 100):
        poses = scene.poses(0.01 * row + 1e-6)
        base = poses["/one/base_link"].rotation
        for wheel, axis in enumerate(axes):
            frame = poses[f"/one/base_link/wheel_{wheel + 1}"].rotation
            rotor = poses[f"/one/base_link/wheel_{wheel + 1}/rotor"].rotation
            np.testing.assert_allclose(rotor[:, 2], base @ axis, atol=1e-3)
            inside = frame.T @ rotor  # about z
            angle = np.arctan2(inside[1, 0], inside[0, 0])
            due = turned[row, wheel] / slowdown
            assert np.angle(np.exp(1j * (angle - due))) == pytest.approx(0.0, abs=4.0 * STEP)
    red = tuple(bytes.fromhex(SATURATED[1:]))
    colours = [
        (time, message["name"])
        for time, message in scene.messages
        if message["type"] == "SceneNodeUpdateMessage"
        and tuple(message["updates"].get("color", ())) == red
    ]
    assert [name for _, name in colours] == ["/one/base_link/wheel_3/rotor"]
    assert colours[0][0] == pytest.approx(0.4, abs=0.04)
