"""Changes of a mission in flight: no jump of position or rate, refusals that change nothing."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from space_robot_control.guidance.courses import Piece, QuinticLeg, Slew
from space_robot_control.guidance.live import BRAKE_S, GoalTolerances, TrajectoryPoint
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.elementary.splines import QuinticSpline
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.errors import InputError

PERIOD = 5e-4
ROBOT = find_robot("paper")
START = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]
GOAL = [15.0, 110.0, 185.0, 45.0, 10.0, -25.0]


def mission(segments: Sequence[str] = (), **settings: Any) -> Mission:
    """A leg of the joints of 10 s, then the segments."""
    texts = [f"{{joints_deg: {GOAL}, duration: 10}}", *segments]
    own = {"joints_deg": START, "segments": texts, **settings}
    return Mission(ROBOT, MissionSettings.model_validate(own), PERIOD)


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


def points_of(*ways: tuple[float, list[float]]) -> list[TrajectoryPoint]:
    """Times and degrees."""
    return [TrajectoryPoint(time, np.radians(row).tolist(), [], []) for time, row in ways]


@pytest.mark.parametrize("tick", [0, 6_000, 30_000])
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


def test_a_refused_segment_leaves_the_mission_alone_and_no_file_is_read() -> None:
    flown = mission()
    before = rows_of(flown)
    for text, said in (
        ("", "."),
        ("{hold: -1}", "hold"),
        ("{tool: {xyz: [30, 0, 0]}, duration: 5}", "tool"),
        ("[", "."),
        ("{file: /etc/passwd}", "^file: no file is read in flight"),
    ):
        with pytest.raises(InputError, match=said) as caught:
            flown.go_to(5_000, text)
        assert "root" not in str(caught.value)
    for part, other in zip(rows_of(flown), before, strict=True):
        np.testing.assert_array_equal(part, other)


@pytest.mark.parametrize("tick", [0, 8_000, 30_000])
def test_a_trajectory_is_joined_and_passes_its_points(tick: int) -> None:
    """Joints in any order."""
    flown = mission()
    names = list(reversed(ROBOT.joint_names))
    ways = [(2.0, [20.0, 100.0, 190.0, 40.0, 5.0, -20.0]), (5.0, GOAL)]
    piece = flown.follow(tick, names, points_of(*((t, row[::-1]) for t, row in ways)))
    joints, base = rows_of(flown, 22.0)
    assert_smooth(joints, base)
    for time, row in ways:
        at = joints[tick + round(time / PERIOD), 0]
        np.testing.assert_allclose(at, np.radians(row), atol=1e-12)
    assert piece.end == pytest.approx(tick * PERIOD + 5.0)
    np.testing.assert_array_equal(joints[-1, 1:], 0.0)


WAYS = [
    (0.0, START),
    (1.0, [2.0, 119.0, 218.0, 1.0, -9.0, 1.0]),
    (3.0, [20.0, 100.0, 190.0, 40.0, 5.0, -20.0]),
    (5.0, GOAL),
]
"""A plan from the present state on, as MoveIt makes it."""


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
    piece = flown.follow(tick, ROBOT.joint_names, points_of(*WAYS), start)
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
    settings = {"joints_deg": [0.0] * robot.n}
    flown = Mission(robot, MissionSettings.model_validate(settings), PERIOD)
    times = np.arange(0, 31) / 10.0
    ramp = [TrajectoryPoint(t, np.full(robot.n, 0.1 * t).tolist(), [], []) for t in times]
    piece = flown.follow(2_000, robot.joint_names, ramp, start=0.2)
    assert piece.motion == "trajectory without its first 18 points"
    row = piece.joints.at(np.array([0.2 + 1.8]))[0, 0]
    np.testing.assert_allclose(row, 0.18, atol=1e-12)


@pytest.mark.parametrize("has_second", [True, False])
def test_given_velocities_are_flown_and_an_end_in_motion_is_brought_to_rest(
    has_second: bool,
) -> None:
    flown, rate = mission(), [0.01] * 6
    goal = np.radians(START) + 0.02
    points = [TrajectoryPoint(2.0, goal.tolist(), rate, [])]
    if has_second:
        points.append(TrajectoryPoint(4.0, (goal + 0.01).tolist(), [], []))
    flown.follow(0, ROBOT.joint_names, points)
    joints, base = rows_of(flown, 6.0)
    assert_smooth(joints, base)
    np.testing.assert_allclose(joints[4_000, 1], rate, atol=1e-14)
    np.testing.assert_array_equal(joints[-1, 1:], 0.0)
    end = goal + (0.01 if has_second else 0.5 * BRAKE_S * 0.01)
    np.testing.assert_allclose(joints[-1, 0], end, atol=1e-12)


NAMES = ROBOT.joint_names
NEAR = np.radians(START).tolist()


def near(time: float, position: Any = NEAR, rate: Any = (), change: Any = ()) -> TrajectoryPoint:
    return TrajectoryPoint(time, position, list(rate), list(change))


REFUSED: list[tuple[Any, list[TrajectoryPoint], float | None, str]] = [
    (NAMES[:5], [near(1.0)], None, "lacks joint 'joint6'"),
    (("a", *NAMES), [near(1.0)], None, "unknown joint 'a'"),
    ((*NAMES, "joint1"), [near(1.0)], None, "a joint twice"),
    (NAMES, [], None, "1 to 100000 points"),
    (NAMES, [near(0.0)], None, "last point is for t = 2.0000 s"),
    (NAMES, [near(-1.0)], None, "must rise from 0 on"),
    (NAMES, [near(2.0), near(1.0)], None, "must rise from 0 on"),
    (NAMES, [near(1.0, NEAR[:5])], None, "5 positions of 6 joints"),
    (NAMES, [near(1.0, NEAR, [0.0])], None, "1 velocities of 6 joints"),
    (NAMES, [near(1.0, [np.nan] * 6)], None, "not finite"),
    (NAMES, [near(2147483647.0)], None, r"got 2.14748e.09 s"),
    (NAMES, [near(1.0, [1e308] * 6)], None, r"positions of 1e\+308"),
    (NAMES, [near(1.0, NEAR, [1e308] * 6)], None, r"velocities of 1e\+308"),
    (NAMES, [near(1.0, NEAR, [], [1e300] * 6)], None, "accelerations of 1e"),
    (NAMES, [near(1e-9, [3.0] * 6)], None, "1e-06 to 1e.06 s"),
    (NAMES, [near(1e-9, [3.0] * 6), near(1.0)], None, "can be flown"),
    (NAMES, points_of(*WAYS), -3.0, "the last point is for t = 2.0000 s, and the reference has"),
    (NAMES, points_of(*WAYS), 1.7e9, "t = 1.7e.09 s is more than 86400 s after now, t = 2.0000 s"),
]


@pytest.mark.parametrize(("names", "points", "start", "said"), REFUSED)
@pytest.mark.filterwarnings("error")
def test_bad_trajectories_are_refused_in_one_line(
    names: Any, points: list[TrajectoryPoint], start: float | None, said: str
) -> None:
    flown = mission()
    before = rows_of(flown, 3.0)
    with pytest.raises(InputError, match=said) as caught:
        flown.follow(4_000, names, points, start)
    assert "\n" not in str(caught.value)
    np.testing.assert_array_equal(rows_of(flown, 3.0)[0], before[0])


# Tolerances of goals

ARM = ("shoulder", "elbow")
BEGIN, END = 1.0, 3.0
LEG = QuinticLeg(BEGIN, END - BEGIN, np.zeros(2), np.array([0.5, -0.5]))
STILL = Slew(BEGIN, 1.0, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), 0.0)
PIECE = Piece(BEGIN, END, LEG, STILL, LEG.rise, STILL.quaternion)
TIME = np.linspace(0.5, 5.0, 451)


def tolerances(seconds: float = 0.0, **entries: Any) -> GoalTolerances:
    """Of a goal, by ``path`` and ``goal``: name, position, velocity."""
    lists = {
        f"{kind}_tolerance": [
            SimpleNamespace(name=name, position=position, velocity=velocity)
            for name, position, velocity in entries.get(kind, ())
        ]
        for kind in ("path", "goal")
    }
    nanoseconds = round(seconds * 1e9)
    duration = SimpleNamespace(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    return GoalTolerances.read(SimpleNamespace(goal_time_tolerance=duration, **lists), ARM)


def flown(error: np.ndarray) -> np.ndarray:
    """The joints as measured, with the errors (T,) of the elbow's position."""
    states = LEG.at(TIME)[:, :2].copy()
    states[:, 0, 1] += error
    return states


def verdict(limits: GoalTolerances, error: np.ndarray) -> tuple[str, str] | None:
    """As told by all states at once, or by one after the other."""
    states = flown(error)
    together = limits.evaluate(PIECE, ARM, TIME, states)
    single = (limits.evaluate(PIECE, ARM, TIME[k : k + 1], states[k : k + 1]) for k in range(451))
    assert together == next(filter(None, single), None)
    return together


OFF = np.where((TIME > 1.995) & (TIME < 2.5), 0.02, 0.001)
LATE = np.where(TIME < 4.0, 0.02, 0.0)
ELBOW = [("elbow", 0.01, 0.0)]
IS_OFF = "the position of joint 'elbow' is off by "


@pytest.mark.parametrize(
    ("limits", "error", "code", "text"),
    [
        ({"path": ELBOW}, OFF, "PATH_TOLERANCE_VIOLATED", IS_OFF + "0.02 at t = 2.0000 s, path_t"),
        ({"path": [("shoulder", 0.01, 0.0)]}, OFF, "SUCCESSFUL", ""),
        ({"path": ELBOW}, np.where(TIME < BEGIN - 0.005, 1.0, 0.0), "SUCCESSFUL", ""),
        ({"seconds": 1.5, "goal": ELBOW}, LATE, "SUCCESSFUL", ""),
        ({"goal": ELBOW}, LATE, "SUCCESSFUL", ""),  # as long as it takes
        (
            {"seconds": 0.5, "goal": ELBOW},
            LATE,
            "GOAL_TOLERANCE_VIOLATED",
            IS_OFF + "0.02 at t = 3.51",
        ),
        (
            {"seconds": 0.5, "path": ELBOW, "goal": ELBOW},
            np.full(451, np.nan),
            "GOAL_TOLERANCE_VIOLATED",
            IS_OFF + "nan",
        ),
    ],
)
def test_tolerances_are_kept_from_the_begin_on_the_way_and_at_the_goal(
    limits: dict[str, Any], error: np.ndarray, code: str, text: str
) -> None:
    found = verdict(tolerances(**limits), error)
    assert found is not None
    assert found[0] == code
    assert found[1].startswith(text)
    assert bool(found[1]) is bool(text)


def test_a_goal_without_a_time_is_waited_for_and_without_numbers_there_is_no_limit() -> None:
    assert verdict(tolerances(goal=ELBOW), np.full(451, 0.02)) is None
    assert not tolerances().are_given
    assert not tolerances(path=[("elbow", 0.0, -1.0)], goal=[("elbow", -1.0, 0.0)]).are_given
    assert tolerances().time == np.inf


def test_rates_are_measured_too() -> None:
    limits, states = tolerances(path=[("shoulder", 0.0, 0.1)]), flown(np.zeros(451))
    assert limits.evaluate(PIECE, ARM, TIME, states) == ("SUCCESSFUL", "")
    states[200, 1, 0] += 0.2
    told = limits.evaluate(PIECE, ARM, TIME, states)
    assert told is not None
    assert "the velocity of joint 'shoulder' is off by 0.2" in told.text


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        (("wrist", 0.1, 0.0), "unknown joint 'wrist' of path_tolerance"),
        (("elbow", -0.5, 0.0), "position of joint 'elbow': a number above 0 was expected, or 0 or"),
        (("elbow", 0.0, np.nan), "velocity of joint 'elbow': .* got nan"),
    ],
)
def test_wrong_tolerances_are_refused_in_one_line(entry: Any, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        tolerances(path=[entry])
    assert "\n" not in str(caught.value)
