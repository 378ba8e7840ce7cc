"""The desired motion: fifth-order polynomials between rests, sampled at ticks."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from random_robots import random_robot

from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

PERIOD = 5e-4
ROBOTS = {n: random_robot(np.random.default_rng(n), n) for n in range(1, 10)}
PAPER_TIMES = [0.0, 15.0, 30.0]
PAPER_DEG = np.array(
    [[0, 120, 220, 0, -10, 0], [15, 110, 185, 45, 10, -25], [30, 100, 150, 90, 30, -50]], float
)


def mission_of(times: Any, degrees: Any, period: float = PERIOD, **more: Any) -> Mission:
    degrees = np.asarray(degrees, dtype=float)
    flat = degrees.ravel().tolist()
    options = MissionSettings(waypoint_times=list(times), waypoints_deg=flat, **more)
    return Mission(ROBOTS[degrees.shape[-1]], options, period)


@pytest.fixture(scope="module")
def paper() -> Mission:
    return mission_of(PAPER_TIMES, PAPER_DEG)


def quintic(a: float, b: float, span: float) -> Polynomial:
    """The polynomial of degree 5 with six boundary conditions, by solving for them."""
    rows = [Polynomial.basis(k) for k in range(6)]
    conditions = [[p.deriv(m)(t) for p in rows] for t in (0.0, 1.0) for m in (0, 1, 2)]
    scaled = np.linalg.solve(np.array(conditions), [a, 0.0, 0.0, b, 0.0, 0.0])
    return Polynomial(scaled / span ** np.arange(6))


@st.composite
def missions(draw: st.DrawFn) -> tuple[Array, Array]:
    """Times and waypoints (degrees) of some legs of 1 to 20 s for 1 to 9 joints."""
    legs, n = draw(st.integers(1, 4)), draw(st.integers(1, 9))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(1.0, 20.0, legs))])
    return times, rng.uniform(-180.0, 180.0, (legs + 1, n))


def test_paper_mission_rests_in_its_waypoints(paper: Mission) -> None:
    """Table II's start, 15 s a leg: position exact, velocity and acceleration zero."""
    assert paper.duration == 30.0
    for tick, waypoint in zip((0, 30_000, 60_000), PAPER_DEG, strict=True):
        position, velocity, acceleration = paper.chunk(tick, 1).joints[0]
        np.testing.assert_allclose(np.degrees(position), waypoint, atol=1e-12)
        np.testing.assert_array_equal(velocity, np.zeros(6))
        np.testing.assert_array_equal(acceleration, np.zeros(6))


def test_halfway_through_a_leg_the_arm_is_halfway_at_full_speed(paper: Mission) -> None:
    """u = 1/2: velocity 15/8 of the mean, acceleration zero."""
    position, velocity, acceleration = paper.chunk(15_000, 1).joints[0]
    np.testing.assert_allclose(np.degrees(position), PAPER_DEG[:2].mean(axis=0), atol=1e-12)
    mean = np.radians(PAPER_DEG[1] - PAPER_DEG[0]) / 15.0
    np.testing.assert_allclose(velocity, 1.875 * mean, atol=1e-15)
    np.testing.assert_allclose(acceleration, 0.0, atol=1e-15)


@settings(max_examples=25)
@given(missions())
def test_legs_are_the_quintics_of_their_boundary_conditions(mission: tuple[Array, Array]) -> None:
    """Position, velocity and acceleration inside every leg, against a linear solve."""
    times, degrees = mission
    period = 0.05
    rows = mission_of(times, degrees, period).chunk(0, int(times[-1] / period)).joints
    time = np.arange(len(rows)) * period
    for leg, (begin, end) in enumerate(pairwise(times)):
        inside = (time >= begin) & (time < end)
        for joint in range(degrees.shape[1]):
            p = quintic(*np.radians(degrees[leg : leg + 2, joint]), end - begin)
            expected = np.stack([p.deriv(m)(time[inside] - begin) for m in (0, 1, 2)], axis=1)
            np.testing.assert_allclose(rows[inside, :, joint], expected, atol=1e-11)


@settings(max_examples=25)
@given(missions())
def test_velocity_and_acceleration_are_the_derivatives_of_the_position(
    mission: tuple[Array, Array],
) -> None:
    """Central differences over the whole mission, across waypoints too."""
    times, degrees = mission
    step = 1e-3
    ticks = int(times[-1] / step)
    position, velocity, acceleration = np.moveaxis(
        mission_of(times, degrees, step).chunk(0, ticks).joints, 1, 0
    )
    np.testing.assert_allclose(
        velocity[1:-1], (position[2:] - position[:-2]) / (2 * step), atol=1e-4
    )
    np.testing.assert_allclose(
        acceleration[1:-1], (velocity[2:] - velocity[:-2]) / (2 * step), atol=0.05
    )


@given(st.integers(0, 70_000), st.integers(1, 300), st.integers(0, 300))
def test_chunks_join_without_a_seam(start: int, length: int, cut: int) -> None:
    """A tick's row has the same bits in whatever chunk it comes."""
    mission = mission_of(PAPER_TIMES, PAPER_DEG)
    whole, cut = mission.chunk(start, length), min(cut, length)
    parts = [mission.chunk(start, cut), mission.chunk(start + cut, length - cut)]
    np.testing.assert_array_equal(np.concatenate([p.joints for p in parts]), whole.joints)
    np.testing.assert_array_equal(np.concatenate([p.base for p in parts]), whole.base)
    assert (whole.start, whole.stop) == (start, start + length)


def test_arm_is_held_before_and_after(paper: Mission) -> None:
    for start, waypoint in ((-50, PAPER_DEG[0]), (60_000, PAPER_DEG[2]), (10**8, PAPER_DEG[2])):
        rows = paper.chunk(start, 50).joints
        expected = np.tile(np.radians(waypoint), (50, 1))
        np.testing.assert_allclose(rows[:, 0], expected, rtol=1e-15)
        np.testing.assert_array_equal(rows[:, 1:], np.zeros((50, 2, 6)))


def test_by_default_one_joint_is_held_at_zero() -> None:
    settings = MissionSettings()
    assert (settings.waypoint_times, settings.waypoints_deg) == ([0.0], [0.0])
    assert settings.base_quaternion == [1.0, 0.0, 0.0, 0.0]


def test_one_waypoint_is_a_pose_to_hold() -> None:
    mission = mission_of([0.0], [[10.0, 20.0]])
    assert mission.duration == 0.0
    rows = mission.chunk(7, 3).joints
    np.testing.assert_allclose(rows[:, 0], np.radians([[10.0, 20.0]] * 3))
    np.testing.assert_array_equal(rows[:, 1:], 0.0)


def test_base_attitude_is_held_and_normalised() -> None:
    mission = mission_of([0.0, 1.0], [[0.0], [9.0]], base_quaternion=[3.0, 0.0, 0.0, -4.0])
    base = mission.chunk(0, 5).base
    np.testing.assert_allclose(base[:, :4], [[0.6, 0.0, 0.0, -0.8]] * 5)
    np.testing.assert_array_equal(base[:, 4:], 0.0)


@pytest.mark.parametrize(
    ("times", "degrees", "more", "why"),
    [
        ([0.0, 5.0], [[1.0, 2.0]], {}, "has 2 values; 2 waypoint_times and 2 joints need 4"),
        ([1.0, 5.0], [[1.0], [2.0]], {}, r"must rise from 0, got \[1.0, 5.0\]"),
        ([0.0, 5.0, 5.0], [[1.0], [2.0], [3.0]], {}, r"must rise from 0, got \[0.0, 5.0, 5.0\]"),
        ([0.0, 5.0, 2.0], [[1.0], [2.0], [3.0]], {}, "must rise from 0"),
        ([0.0], [[1.0]], {"base_quaternion": [0.0] * 4}, "base_quaternion must have a norm of"),
        ([], [[]], {}, "waypoint_times"),
        ([0.0, float("inf")], [[1.0], [2.0]], {}, "waypoint_times"),
        ([0.0], [[float("nan")]], {}, "waypoints_deg"),
        ([0.0], [[1.0]], {"base_quaternion": [1.0]}, "base_quaternion"),
    ],
)
def test_errors_say_what_was_given_and_what_is_allowed(
    times: list[float], degrees: Any, more: dict[str, Any], why: str
) -> None:
    """InputError and Pydantic's ValidationError are both ValueErrors."""
    with pytest.raises(ValueError, match=why):
        mission_of(times, degrees, **more)


def test_misfit_is_an_input_error() -> None:
    with pytest.raises(InputError):
        mission_of([0.0, 1.0], [[1.0, 2.0]])
