"""Missions whose base points: starts, segments of any kind meanwhile, changes in flight."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from strategies import random_quaternion

from space_robot_control.guidance.courses import Slew
from space_robot_control.guidance.goals import PointingGoal
from space_robot_control.guidance.live import TrajectoryPoint
from space_robot_control.guidance.mission import Mission, MissionSettings, pointing_start
from space_robot_control.guidance.pointing import PointingCourse
from space_robot_control.guidance.tool_paths import JOIN_S
from space_robot_model.elementary.matrices import Array
from space_robot_model.orbit.ephemeris import AssumedOrbit, Ephemeris
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.kinematics import tool_state
from space_robot_msgs_py.errors import InputError

PERIOD = 5e-3
ROBOT = find_robot("paper")
START = [0.0, 90.0, 200.0, 20.0, 30.0, 10.0]
NEAR = [10.0, 80.0, 190.0, 20.0, 30.0, 10.0]
ISS = {"orbital_elements": {"height": 420e3, "eccentricity": 0.0005, "inclination_deg": 51.64}}
NADIR = json.dumps({"point": "nadir"})
SMALL = {"xyz": [0.1, -0.1, -0.1], "rpy_deg": [0.0, 0.0, 10.0]}
RATE = [0.3, -0.2, 0.5]
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def planned(*segments: dict[str, Any], orbit: bool = True, **settings: Any) -> Mission:
    texts = [json.dumps(segment) for segment in segments]
    numbers = {"joints_deg": START, "segments": texts, **settings}
    if orbit:
        numbers["assumed_orbit"] = ISS
    return Mission(ROBOT, MissionSettings.model_validate(numbers), PERIOD)


def whole(mission: Mission, beyond: float = 0.0) -> tuple[Array, Array]:
    chunk = mission.chunk(0, round((mission.duration + beyond) / PERIOD) + 1)
    return chunk.joints, chunk.base


def course_of(goal: dict[str, Any], near: Array) -> PointingCourse:
    ephemeris = Ephemeris(AssumedOrbit.model_validate(ISS))
    return PointingCourse(PointingGoal.model_validate(goal), ephemeris, 0.0, near)


def turns(quaternions: Array) -> Rotation:
    return Rotation.from_quat(quaternions, scalar_first=True)


def angles(quaternions: Array, others: Array) -> Array:
    """Return the angles between attitudes, rad."""
    angle: Array = (turns(quaternions).inv() * turns(others)).magnitude()
    return angle


def assert_consistent(joints: Array, base: Array) -> None:
    """Rates and accelerations are derivatives: of a parabola between two ticks."""
    for values in (joints, np.stack((base[:, 4:7], base[:, 7:]), axis=1)):
        for order in range(values.shape[1] - 1):
            mean = 0.5 * (values[1:, order + 1] + values[:-1, order + 1])
            change = np.diff(values[:, order], axis=0)
            assert np.abs(change - mean * PERIOD).max() < 5e-6
    step = (turns(base[:-1, :4]).inv() * turns(base[1:, :4])).as_rotvec()
    mean = 0.5 * (base[1:, 4:7] + base[:-1, 4:7])
    assert np.abs(step - mean * PERIOD).max() < 2e-6


def test_modes_go_on_and_are_joined_without_a_jump() -> None:
    mission = planned(
        {"tool": {**SMALL, "frame": "orbit"}, "duration": 5},
        {"hold": 2},
        {"joints_deg": NEAR, "base": "sun", "duration": 40},
        {"tool": SMALL, "duration": 5},
        {"base": {"point": "nadir", "offset_deg": [0, 10, 0]}, "hold": 40},
        {"base": {"rpy_deg": [0, 0, 30]}, "joints_deg": START, "duration": 40},
        {"base": {"turn_deg": 200, "axis": [1, 2, 3]}, "duration": 40},
        base_point=NADIR,
    )
    joints, base = whole(mission, beyond=10.0)
    assert_consistent(joints, base)
    modes = [piece.mode and piece.mode.point for piece in mission.pieces]
    assert modes == ["nadir", "nadir", "sun", "sun", "nadir", None, None]
    near = base[0, :4]
    for goal, begin, end in (
        ({"point": "nadir"}, 0.0, 7.0),
        ({"point": "sun"}, 47.0, 52.0),
        ({"point": "nadir", "offset_deg": [0, 10, 0]}, 92.0, 92.0),
    ):
        times = np.arange(begin, end + PERIOD / 2, PERIOD)
        wanted = course_of(goal, near).at(times)
        rows = base[np.round(times / PERIOD).astype(int)]
        assert angles(rows[:, :4], wanted[:, :4]).max() < 1e-7
        np.testing.assert_allclose(rows[:, 4:], wanted[:, 4:], rtol=0.0, atol=1e-12)
    ends = np.array([(132.0, 0.0), (172.0, 200.0), (182.0, 200.0)])
    level = turns(np.array(mission.pieces[-1].base.at(np.array([132.0]))[0, :4]))
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    for time, degrees in ends:
        row = base[round(time / PERIOD)]
        wanted = level * Rotation.from_rotvec(np.radians(degrees) * axis)
        assert (turns(row[:4]).inv() * wanted).magnitude() < 1e-7
        assert np.abs(row[4:]).max() < 1e-12
    np.testing.assert_allclose(level.as_euler("xyz", degrees=True), [0, 0, 30], atol=1e-9)


def test_a_mode_goes_on_after_the_missions_end_and_is_not_slewed_to_again() -> None:
    once = planned({"hold": 20}, base_point=NADIR)
    thrice = planned({"hold": 5}, {"base": "nadir", "hold": 5}, {"hold": 2}, base_point=NADIR)
    assert np.array_equal(whole(once)[1], whole(thrice, beyond=8.0)[1])
    moved = planned({"joints_deg": NEAR, "duration": 5}, base_point=NADIR)
    assert np.array_equal(whole(once)[1], whole(moved, 15.0)[1])
    still = planned(base_point=NADIR)
    assert np.array_equal(still.chunk(0, 100).base, once.chunk(0, 100).base)


def test_a_mission_that_starts_pointing_begins_on_its_course() -> None:
    settings = MissionSettings(joints_deg=START, base_point=NADIR, assumed_orbit=ISS)
    attitude, rate_deg_s = pointing_start(settings)
    row = Mission(ROBOT, settings, PERIOD).chunk(0, 1).base[0]
    np.testing.assert_array_equal(attitude, row[:4])
    np.testing.assert_allclose(np.radians(rate_deg_s), row[4:7], rtol=1e-15)
    position = Ephemeris(settings.assumed_orbit).motion(np.zeros(1)).position[0]
    down = turns(row[:4]).apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(down, -position / np.linalg.norm(position), atol=1e-14)


@pytest.mark.parametrize(
    "base",
    [{"rpy_deg": [0, 0, 0]}, "nadir", {"point": "inertial", "direction": [1, 1, 0]}],
    ids=["rest", "nadir", "inertial"],
)
def test_a_first_segment_that_moves_the_base_begins_with_the_starts_rate(base: Any) -> None:
    mission = planned({"base": base, "duration": 30}, {"hold": 1}, base_rate_deg_s=RATE)
    joints, rows = whole(mission)
    assert_consistent(joints, rows)
    np.testing.assert_allclose(np.degrees(rows[0, 4:7]), RATE, rtol=1e-12)
    assert np.abs(rows[0, 7:]).max() < 1e-12
    if base != "nadir":
        assert np.abs(rows[-1, 4:]).max() < 1e-12


@pytest.mark.parametrize("first", [{"hold": 3}, {"joints_deg": NEAR, "duration": 3}])
def test_other_first_segments_begin_at_rest(first: dict[str, Any]) -> None:
    segments = first, {"base": {"rpy_deg": [0, 0, 9]}, "duration": 9}
    mission = planned(*segments, orbit=False)
    same = planned(*segments, orbit=False, base_rate_deg_s=RATE)
    assert np.array_equal(whole(mission)[1], whole(same)[1])
    assert isinstance(same.pieces[1].base, Slew)


@given(
    degrees=st.sampled_from([170.0, 180.0, 190.0, 350.0, -725.0]),
    seed=st.integers(0, 2**32 - 1).map(np.random.default_rng),
)
def test_a_turn_goes_through_its_whole_angle(degrees: float, seed: np.random.Generator) -> None:
    start, axis = random_quaternion(seed), seed.normal(size=3)
    turn = {"base": {"turn_deg": degrees, "axis": axis.tolist()}, "duration": 20}
    mission = planned(turn, orbit=False, base_quaternion=start.tolist())
    _, base = whole(mission)
    end = turns(start) * Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis))
    assert (turns(base[-1, :4]).inv() * end).magnitude() < 1e-7
    rates = np.linalg.norm(base[:, 4:7], axis=1)
    assert rates.max() == pytest.approx(15.0 / 8.0 * np.radians(abs(degrees)) / 20.0, rel=1e-6)
    np.testing.assert_allclose(rates.sum() * PERIOD, np.radians(abs(degrees)), rtol=1e-9)


@pytest.mark.parametrize("frame", ["start", "orbit"])
@pytest.mark.parametrize("start", ["nadir", "rest"])
def test_a_tool_goes_straight_or_joins_its_path_where_the_base_carries_it(
    frame: str, start: str
) -> None:
    """The base turns against the path's axes, unless both turn with the orbit or stand still."""
    segment = {"tool": {**SMALL, "frame": frame}, "duration": 8}
    mission = planned(segment, **({"base_point": NADIR} if start == "nadir" else {}))
    joints, base = whole(mission)
    states = [tool_state(ROBOT, b[:4], j[0]) for b, j in zip(base, joints, strict=True)]
    assert_consistent(joints, base)
    assert np.abs(joints[[0, -1], 1]).max() < 1e-9
    assert np.abs(joints[:, 2]).max() < 0.1
    axes = Rotation.identity(len(base))
    if frame == "orbit":
        course = course_of({"point": "nadir"}, IDENTITY)
        axes = turns(course.at(np.arange(len(base)) * PERIOD)[:, :4])
    path = axes.inv().apply([state.position for state in states])
    np.testing.assert_allclose(path[-1] - path[0], SMALL["xyz"], atol=1e-9)
    unit = np.array(SMALL["xyz"]) / np.linalg.norm(SMALL["xyz"])
    away = np.linalg.norm(path - path[0] - np.outer((path - path[0]) @ unit, unit), axis=1)
    within = round(JOIN_S / PERIOD)
    assert away[within:-within].max() < 1e-8
    assert away.max() < (1e-8 if (frame == "orbit") == (start == "nadir") else 2e-3)
    first, last = (axes[k].inv() * Rotation.from_matrix(states[k].rotation) for k in (0, -1))
    turn = (last * first.inv()).as_euler("xyz", degrees=True)
    np.testing.assert_allclose(turn, SMALL["rpy_deg"], atol=1e-6)


@pytest.mark.parametrize("tick", [200, 1_000, 3_000])
@pytest.mark.parametrize(
    "segment",
    [
        {"hold": 2},
        {"joints_deg": NEAR, "duration": 5},
        {"base": "sun", "duration": 30},
        {"base": {"rpy_deg": [0, 0, 0]}, "duration": 30},
        {"tool": {**SMALL, "frame": "orbit"}, "duration": 5},
    ],
    ids=["hold", "joints", "sun", "rest", "tool"],
)
def test_a_base_that_points_is_not_braked_by_a_new_segment(
    tick: int, segment: dict[str, Any]
) -> None:
    """At tick 200 the joints move, at 1,000 the base slews, at 3,000 it points alone."""
    texts = [{"joints_deg": NEAR, "duration": 2}, {"base": "velocity", "duration": 10}, {"hold": 9}]
    mission = planned(*texts, base_point=NADIR)
    before = mission.chunk(0, tick)
    piece = mission.go_to(tick, json.dumps(segment))
    after = mission.chunk(0, round(max(piece.end, 12.0) / PERIOD) + 200)
    assert np.array_equal(after.base[:tick], before.base)
    assert_consistent(after.joints, after.base)
    is_braked = any(piece.motion == "braking" for piece in mission.pieces)
    assert is_braked is (tick == 200)
    if "base" not in segment:
        goal = {"point": "nadir" if tick == 200 else "velocity"}
        time = np.array([max(piece.end, 12.0) + 0.5])
        row = after.base[round(time[0] / PERIOD)]
        assert angles(row[np.newaxis, :4], course_of(goal, row[:4]).at(time)[:, :4])[0] < 1e-7


def test_a_trajectory_in_flight_leaves_a_base_that_points_alone() -> None:
    mission, alone = (planned({"hold": 20}, base_point=NADIR) for _ in range(2))
    there = np.radians(NEAR).tolist()
    point = TrajectoryPoint(4.0, there, [], [])
    moving = TrajectoryPoint(8.0, (np.array(there) + 0.1).tolist(), [0.02] * 6, [])
    piece = mission.follow(400, ROBOT.joint_names, [point, moving])
    assert piece.mode == PointingGoal(point="nadir")
    assert mission.pieces[-1].motion == "braking"
    chunk = mission.chunk(0, 3_000)
    assert np.array_equal(chunk.base, alone.chunk(0, 3_000).base)
    assert_consistent(chunk.joints, chunk.base)


def test_columns_of_the_base_win_over_what_it_points_at() -> None:
    course, times = course_of({"point": "nadir"}, IDENTITY), np.linspace(0.0, 10.0, 101)
    rows, columns = course.at(times), {"time": times.tolist()}
    for name, angle in zip(ROBOT.joint_names, np.radians(START), strict=True):
        columns[name] = [angle] * 101
    mission = planned({"trajectory": columns}, {"hold": 1}, base_point=NADIR)
    assert [piece.mode is None for piece in mission.pieces] == [False, False]
    columns |= {f"q_{n}": rows[:, k].tolist() for k, n in enumerate("wxyz")}
    mission = planned({"trajectory": columns}, {"hold": 1}, base_point=NADIR)
    assert [piece.mode for piece in mission.pieces] == [None, None]
    _, base = whole(mission)
    inside = course.at(np.arange(0.0, 9.0, PERIOD))
    assert angles(base[: len(inside), :4], inside[:, :4]).max() < 1e-6
    np.testing.assert_allclose(base[: len(inside), 4:7], inside[:, 4:7], rtol=0.0, atol=1e-6)
    columns |= {f"q_{n}": [-float(n == "w")] * 101 for n in "wxyz"}
    with pytest.raises(InputError, match="the base begins with another attitude"):
        planned({"trajectory": columns}, base_point=NADIR)
