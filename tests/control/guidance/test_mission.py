"""The desired motion: fifth-order polynomials between rests, sampled at ticks; limits of joints."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import DATA
from scipy.interpolate import BPoly
from strategies import random_robot

from space_robot.tuning.warning import effort_remarks, limit_remarks
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot

PERIOD = 5e-4
ROBOTS = {n: random_robot(np.random.default_rng(n), n) for n in range(1, 10)}
PAPER_DEG = np.array(
    [[0, 120, 220, 0, -10, 0], [15, 110, 185, 45, 10, -25], [30, 100, 150, 90, 30, -50]], float
)


def mission_of(times: Any, degrees: Any, period: float = PERIOD, **more: Any) -> Mission:
    start, *goals = np.asarray(degrees, dtype=float).tolist()
    spans = np.diff(times).tolist()
    rows = zip(goals, spans, strict=True)
    segments = [f"{{joints_deg: {goal}, duration: {span!r}}}" for goal, span in rows]
    options = MissionSettings(joints_deg=start, segments=segments, **more)
    return Mission(ROBOTS[len(start)], options, period)


@st.composite
def missions(draw: st.DrawFn) -> tuple[Array, Array]:
    """Times and waypoints (degrees) of some legs of 1 to 20 s for 1 to 9 joints."""
    legs, n = draw(st.integers(1, 4)), draw(st.integers(1, 9))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(1.0, 20.0, legs))])
    return times, rng.uniform(-180.0, 180.0, (legs + 1, n))


@settings(max_examples=25)
@given(missions())
def test_legs_are_the_quintics_of_their_boundary_conditions(mission: tuple[Array, Array]) -> None:
    """Position, velocity and acceleration inside every leg, against SciPy."""
    times, degrees = mission
    period = 0.05
    rows = mission_of(times, degrees, period).chunk(0, int(times[-1] / period)).joints
    time = np.arange(len(rows)) * period
    for leg, (begin, end) in enumerate(pairwise(times)):
        inside = (time >= begin) & (time < end)
        rests = np.zeros((2, 3, degrees.shape[1]))
        rests[:, 0] = np.radians(degrees[leg : leg + 2])
        quintic = BPoly.from_derivatives([begin, end], rests)
        expected = np.stack([quintic(time[inside], nu=m) for m in (0, 1, 2)], axis=1)
        np.testing.assert_allclose(rows[inside], expected, atol=1e-11)


@given(st.integers(-50, 70_000), st.integers(1, 300), st.integers(0, 300))
def test_chunks_join_without_a_seam_and_the_arm_is_held_beyond_its_ends(
    start: int, length: int, cut: int
) -> None:
    """A tick's row has the same bits in whatever chunk it comes."""
    mission = mission_of([0.0, 15.0, 30.0], PAPER_DEG)
    assert mission.duration == 30.0
    whole, cut = mission.chunk(start, length), min(cut, length)
    parts = [mission.chunk(start, cut), mission.chunk(start + cut, length - cut)]
    np.testing.assert_array_equal(np.concatenate([p.joints for p in parts]), whole.joints)
    np.testing.assert_array_equal(np.concatenate([p.base for p in parts]), whole.base)
    assert (whole.start, whole.stop) == (start, start + length)
    ticks = np.arange(start, start + length)
    for at_rest, waypoint in ((ticks <= 0, 0), (ticks == 30_000, 1), (ticks >= 60_000, 2)):
        rows = np.broadcast_to(np.radians(PAPER_DEG[waypoint]), (at_rest.sum(), 6))
        np.testing.assert_allclose(whole.joints[at_rest, 0], rows, rtol=0.0, atol=1e-14)
        np.testing.assert_array_equal(whole.joints[at_rest, 1:], 0.0)


def test_a_start_alone_is_held_by_default_zero() -> None:
    settings = MissionSettings()
    assert (settings.joints_deg, settings.segments) == ([0.0], [""])
    assert settings.base_quaternion == [1.0, 0.0, 0.0, 0.0]
    mission = mission_of([0.0], [[10.0, 20.0]], base_quaternion=[3.0, 0.0, 0.0, -4.0])
    assert mission.duration == 0.0
    rows = mission.chunk(7, 3)
    np.testing.assert_allclose(rows.joints[:, 0], np.radians([[10.0, 20.0]] * 3))
    np.testing.assert_array_equal(rows.joints[:, 1:], 0.0)
    np.testing.assert_allclose(rows.base[:, :4], [[0.6, 0.0, 0.0, -0.8]] * 3)
    np.testing.assert_array_equal(rows.base[:, 4:], 0.0)


# Limits


ROBOT = Robot.from_yaml(DATA / "passive_robot" / "robot.yaml")
"""A shoulder of 120 degrees and 30 degrees/s, a boom of 1.5 m and 0.4 m/s, a free wrist."""


def mission(end: list[float], span: float = 10.0) -> MissionSettings:
    segment = f"{{joints_deg: {[*end, *[0.0] * 3]}, duration: {span}}}"
    return MissionSettings(joints_deg=[0.0, 0.2, *[0.0] * 4], segments=[segment])


@pytest.mark.parametrize("end", [[120.0, 1.5, 900.0], [-120.0, 0.0, 0.0]])
def test_limits_themselves_and_joints_without_any_are_allowed(end: list[float]) -> None:
    Mission(ROBOT, mission(end), 0.01)


def test_forces_are_held_against_efforts() -> None:
    force = np.array([[39.0, -21.0, *[1e9] * 4], [-39.5, 3.0, *[0.0] * 4]])
    said = "boom needs 21 N and more, its limit is 20 N"
    assert effort_remarks(ROBOT, force) == [said]


def test_remarks_name_joint_number_and_unit() -> None:
    """A mission of 8 s is within the limits; one of small motions in 0.3 s asks for too much."""
    at_rest = MissionSettings(joints_deg=[0.0, 0.2, *[0.0] * 4])
    cases = mission([30.0, 0.8, -10.0], 8.0), at_rest, mission([4.0, 0.25, 0.0], 0.3)
    slow, none, said = (limit_remarks(ROBOT, Mission(ROBOT, s, 0.01).pieces) for s in cases)
    assert not slow + none
    assert [" ".join(line.split(" ")[2:4]) for line in said] == ["shoulder needs", "boom needs"]
    assert said[1].endswith("N and more, its limit is 20 N")
