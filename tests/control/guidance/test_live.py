"""Changes of a mission in flight: no jump of position or rate, and refusals that change nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from space_robot_control.guidance.live import BRAKE_S, TrajectoryPoint
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.elementary.quintic_spline import QuinticSpline
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.errors import InputError

PERIOD = 5e-4
ROBOT = find_robot("paper")
START = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]
GOAL = [15.0, 110.0, 185.0, 45.0, 10.0, -25.0]


def mission(**settings: Any) -> Mission:
    waypoints = {"waypoint_times": [0.0, 10.0], "waypoints_deg": [*START, *GOAL]}
    return Mission(ROBOT, MissionSettings.model_validate({**waypoints, **settings}), PERIOD)


def rows_of(flown: Mission, seconds: float = 21.0) -> tuple[np.ndarray, np.ndarray]:
    chunk = flown.chunk(0, round(seconds / PERIOD))
    return chunk.joints, chunk.base


def assert_smooth(joints: np.ndarray, base: np.ndarray) -> None:
    """Positions change by the rates, and rates by the accelerations, from tick to tick."""
    for values in (joints[:, 0], joints[:, 1]):
        assert np.abs(np.diff(values, n=2, axis=0)).max() < 1e-3 * np.abs(values).max() + 1e-6
    mean = 0.5 * (joints[1:, 1] + joints[:-1, 1])
    np.testing.assert_allclose(np.diff(joints[:, 0], axis=0), mean * PERIOD, atol=1e-7)
    assert np.abs(np.diff(joints[:, 1], axis=0)).max() < 1e-3
    assert np.abs(np.diff(base[:, :4], axis=0)).max() < 1e-3
    assert np.abs(np.diff(base[:, 4:7], axis=0)).max() < 1e-3


@given(st.integers(2, 8), st.integers(1, 4), st.integers(0, 2**31 - 1))
def test_quintic_splines_are_scipys(knots: int, size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    times, states = np.cumsum(rng.uniform(0.1, 2.0, knots)), rng.normal(size=(knots, 3, size))
    theirs = BPoly.from_derivatives(times, states)
    at = rng.uniform(times[0], times[-1], 40)
    rows = QuinticSpline(times, states).at(at)
    for order in range(3):
        expected = theirs.derivative(order)(at) if order else theirs(at)
        scale = max(1.0, float(np.abs(expected).max()))
        np.testing.assert_allclose(rows[:, order], expected, rtol=0.0, atol=1e-9 * scale)


@pytest.mark.parametrize("tick", [0, 6_000, 10_000, 30_000])
def test_a_segment_begins_without_a_jump(tick: int) -> None:
    flown = mission()
    before, _ = rows_of(flown)
    piece = flown.go_to(
        tick, "{tool: {xyz: [0.1, 0.0, -0.1]}, base: {rpy_deg: [0, 0, 2]}, duration: 5}"
    )
    joints, base = rows_of(flown)
    np.testing.assert_array_equal(joints[:tick, 0], before[:tick, 0])
    assert_smooth(joints, base)
    moved = 0 < tick < 20_000
    assert piece.begin == pytest.approx(tick * PERIOD + (BRAKE_S if moved else 0.0))
    np.testing.assert_array_equal(joints[-1, 0], piece.goal)
    np.testing.assert_allclose(base[-1, :4], piece.attitude, atol=1e-15)


def test_a_turning_base_is_brought_to_rest_first() -> None:
    flown = mission(segments=["{base: {rpy_deg: [0, 10, 20]}, duration: 8}"])
    flown.go_to(27_000, "{base: {rpy_deg: [0, 0, 0]}, duration: 5}")
    joints, base = rows_of(flown, 25.0)
    assert np.abs(base[27_000, 4:7]).max() > 0.01
    assert_smooth(joints, base)
    np.testing.assert_allclose(np.abs(base[-1, :4]), [1.0, 0.0, 0.0, 0.0], atol=1e-12)


def test_a_refused_segment_leaves_the_mission_alone() -> None:
    flown = mission()
    before = rows_of(flown)
    for text in ("", "{hold: -1}", "{tool: {xyz: [30, 0, 0]}, duration: 5}", "["):
        with pytest.raises(InputError):
            flown.go_to(5_000, text)
    for part, other in zip(rows_of(flown), before, strict=True):
        np.testing.assert_array_equal(part, other)


def test_no_file_is_read_in_flight() -> None:
    with pytest.raises(InputError, match=r"^file: no file is read in flight") as caught:
        mission().go_to(5_000, "{file: /etc/passwd}")
    assert "root" not in str(caught.value)


@pytest.mark.parametrize("tick", [0, 8_000, 30_000])
def test_a_trajectory_is_joined_and_passes_its_points(tick: int) -> None:
    flown = mission()
    names = list(reversed(ROBOT.joint_names))
    ways = [(2.0, [20.0, 100.0, 190.0, 40.0, 5.0, -20.0]), (5.0, GOAL)]
    piece = flown.follow(
        tick, names, [TrajectoryPoint(t, np.radians(row[::-1]).tolist(), [], []) for t, row in ways]
    )
    joints, base = rows_of(flown, 22.0)
    assert_smooth(joints, base)
    for time, row in ways:
        np.testing.assert_allclose(
            joints[tick + round(time / PERIOD), 0], np.radians(row), atol=1e-12
        )
    assert piece.end == pytest.approx(tick * PERIOD + 5.0)
    np.testing.assert_array_equal(joints[-1, 1:], 0.0)


WAYS = [
    (0.0, START),
    (1.0, [2.0, 119.0, 218.0, 1.0, -9.0, 1.0]),
    (3.0, [20.0, 100.0, 190.0, 40.0, 5.0, -20.0]),
    (5.0, GOAL),
]
"""A plan from the present state on, as MoveIt makes it."""


def points_of(ways: list[tuple[float, list[float]]]) -> list[TrajectoryPoint]:
    return [TrajectoryPoint(time, np.radians(row).tolist(), [], []) for time, row in ways]


@pytest.mark.parametrize(
    ("start", "begin", "left_out"),
    [
        (None, 4.0, "without its first point"),  # stamp 0: now
        (3.9, 4.0, "without its first point"),
        (2.5, 4.0, "without its first 2 points"),
        (0.5, 4.0, "without its first 3 points"),
        (6.0, 6.0, "without its first point"),
        (6.00012, 6.0005, "without its first point"),  # between two ticks
    ],
)
def test_a_trajectory_starts_at_its_stamp_or_is_joined_on_its_way(
    start: float | None, begin: float, left_out: str
) -> None:
    """Until then the mission goes on; each point that is left is passed at its time."""
    flown, tick = mission(), 8_000
    before, _ = rows_of(flown)
    piece = flown.follow(tick, ROBOT.joint_names, points_of(WAYS), start)
    assert (piece.begin, piece.motion) == (pytest.approx(begin), f"trajectory {left_out}")
    joints, _ = rows_of(flown)
    first = round(begin / PERIOD)
    np.testing.assert_array_equal(joints[:first], before[:first])
    assert np.abs(np.diff(joints[:, 1], axis=0)).max() < 0.02  # 40 rad/s2, where 0.5 s are left
    origin = tick * PERIOD if start is None else start
    for time, row in WAYS:
        if origin + time > begin:
            at = piece.joints.at(np.array([origin + time]))[0]
            np.testing.assert_allclose(at[0], np.radians(row), atol=1e-12)
    assert piece.end == pytest.approx(origin + 5.0)
    np.testing.assert_allclose(joints[-1, 0], np.radians(GOAL), atol=1e-12)


def test_a_late_trajectory_is_joined_where_the_joints_can_reach_it() -> None:
    robot = find_robot("dual_arm")  # 20 degrees/s at most
    settings = {"waypoint_times": [0.0], "waypoints_deg": [0.0] * robot.n}
    flown = Mission(robot, MissionSettings.model_validate(settings), PERIOD)
    times = np.arange(0, 31) / 10.0
    ramp = [TrajectoryPoint(t, np.full(robot.n, 0.1 * t).tolist(), [], []) for t in times]
    piece = flown.follow(2_000, robot.joint_names, ramp, start=0.2)
    assert piece.motion == "trajectory without its first 18 points"
    row = piece.joints.at(np.array([0.2 + 1.8]))[0, 0]
    np.testing.assert_allclose(row, 0.18, atol=1e-12)


@pytest.mark.parametrize(
    ("start", "said"),
    [
        (-1.0, "the last point is for t = 4.0000 s, and the reference has been sent until t = 4.0"),
        (
            1.7e9,
            "the start at t = 1.7e\\+09 s is more than 86400 s after now, t = 4.0000 s: stamps",
        ),
    ],
)
def test_a_trajectory_of_another_time_is_refused(start: float, said: str) -> None:
    flown = mission()
    before = rows_of(flown)
    with pytest.raises(InputError, match=said):
        flown.follow(8_000, ROBOT.joint_names, points_of(WAYS), start)
    np.testing.assert_array_equal(rows_of(flown)[0], before[0])


def test_given_velocities_are_flown() -> None:
    flown = mission()
    rate = [0.01] * 6
    flown.follow(
        0,
        ROBOT.joint_names,
        [
            TrajectoryPoint(2.0, (np.radians(START) + 0.01).tolist(), rate, []),
            TrajectoryPoint(4.0, (np.radians(START) + 0.02).tolist(), [], []),
        ],
    )
    joints, _ = rows_of(flown, 6.0)
    np.testing.assert_allclose(joints[4_000, 1], rate, atol=1e-14)


def test_a_trajectory_that_ends_in_motion_is_brought_to_rest() -> None:
    flown, rate = mission(), [0.01] * 6
    goal = (np.radians(START) + 0.02).tolist()
    flown.follow(0, ROBOT.joint_names, [TrajectoryPoint(2.0, goal, rate, [])])
    joints, base = rows_of(flown, 6.0)
    assert_smooth(joints, base)
    np.testing.assert_allclose(joints[4_000, 1], rate, atol=1e-14)
    np.testing.assert_array_equal(joints[-1, 1:], 0.0)
    np.testing.assert_allclose(joints[-1, 0], np.array(goal) + 0.5 * BRAKE_S * 0.01, atol=1e-12)


NEAR = np.radians(START).tolist()


@pytest.mark.parametrize(
    ("names", "given_points", "said"),
    [
        (ROBOT.joint_names[:5], [TrajectoryPoint(1.0, NEAR, [], [])], "lacks joint 'joint6'"),
        (("a", *ROBOT.joint_names), [TrajectoryPoint(1.0, NEAR, [], [])], "unknown joint 'a'"),
        ((*ROBOT.joint_names, "joint1"), [TrajectoryPoint(1.0, NEAR, [], [])], "a joint twice"),
        (ROBOT.joint_names, [], "1 to 100000 points"),
        (ROBOT.joint_names, [TrajectoryPoint(0.0, NEAR, [], [])], "last point is for t = 2.0000 s"),
        (ROBOT.joint_names, [TrajectoryPoint(-1.0, NEAR, [], [])], "must rise from 0 on"),
        (
            ROBOT.joint_names,
            [TrajectoryPoint(2.0, NEAR, [], []), TrajectoryPoint(1.0, NEAR, [], [])],
            "must rise from 0 on",
        ),
        (ROBOT.joint_names, [TrajectoryPoint(1.0, NEAR[:5], [], [])], "5 positions of 6 joints"),
        (ROBOT.joint_names, [TrajectoryPoint(1.0, NEAR, [0.0], [])], "1 velocities of 6 joints"),
        (ROBOT.joint_names, [TrajectoryPoint(1.0, [np.nan] * 6, [], [])], "not finite"),
        (ROBOT.joint_names, [TrajectoryPoint(2147483647.0, NEAR, [], [])], r"got 2.14748e.09 s"),
        (ROBOT.joint_names, [TrajectoryPoint(1.0, [1e308] * 6, [], [])], r"positions of 1e\+308"),
        (
            ROBOT.joint_names,
            [TrajectoryPoint(1.0, NEAR, [1e308] * 6, [])],
            r"velocities of 1e\+308",
        ),
        (ROBOT.joint_names, [TrajectoryPoint(1.0, NEAR, [], [1e300] * 6)], "accelerations of 1e"),
        (ROBOT.joint_names, [TrajectoryPoint(1e-9, [3.0] * 6, [], [])], "1e-06 to 1e.06 s"),
        (
            ROBOT.joint_names,
            [TrajectoryPoint(1e-9, [3.0] * 6, [], []), TrajectoryPoint(1.0, NEAR, [], [])],
            "can be flown",
        ),
    ],
)
@pytest.mark.filterwarnings("error")
def test_bad_trajectories_are_refused_in_one_line(
    names: tuple[str, ...], given_points: list[TrajectoryPoint], said: str
) -> None:
    flown = mission()
    before = rows_of(flown)
    with pytest.raises(InputError, match=said) as caught:
        flown.follow(4_000, names, given_points)
    assert "\n" not in str(caught.value)
    np.testing.assert_array_equal(rows_of(flown)[0], before[0])
