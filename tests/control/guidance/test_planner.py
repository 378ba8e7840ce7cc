"""Plans of segments: what the tool, the joints and the base do is what was asked for."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from space_robot_control.guidance.courses import MOST_KNOTS, knots, sample_times
from space_robot_control.guidance.demand import demand
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_control.guidance.trajectory_file import with_columns
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.kinematics import tool_state
from space_robot_msgs_py.errors import InputError

PERIOD = 5e-4
STARTS = {
    "paper": [0.0, 120.0, 220.0, 0.0, -10.0, 0.0],
    "seven_joint": [10.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0],
}


def planned(*segments: dict[str, Any], robot: str = "paper", **settings: Any) -> Mission:
    texts = [json.dumps(segment) for segment in segments]
    start = {"waypoints_deg": STARTS[robot], "segments": texts, **settings}
    return Mission(find_robot(robot), MissionSettings.model_validate(start), PERIOD)


def whole(mission: Mission) -> tuple[np.ndarray, np.ndarray]:
    chunk = mission.chunk(0, round(mission.duration / PERIOD) + 1)
    return chunk.joints, chunk.base


def assert_consistent(values: np.ndarray, scale: float) -> None:
    """Rates and accelerations are the derivatives of the positions, to the rounding of these."""
    position, rate, acceleration = np.moveaxis(values, 1, 0)
    middle = (position[2:] - position[:-2]) / (2.0 * PERIOD)
    np.testing.assert_allclose(rate[1:-1], middle, rtol=0.0, atol=1e-6 * scale)
    middle = (rate[2:] - rate[:-2]) / (2.0 * PERIOD)
    np.testing.assert_allclose(acceleration[1:-1], middle, rtol=0.0, atol=1e-3 * scale)


def tool_of(robot: Robot, joints: np.ndarray, base: np.ndarray, ticks: range) -> list[Any]:
    return [tool_state(robot, base[k, :4], joints[k, 0]) for k in ticks]


@pytest.mark.parametrize("robot", STARTS)
def test_a_tool_goes_straight_and_turns_about_one_axis(robot: str) -> None:
    goal = {"xyz": [0.2, 0.1, -0.15], "rpy_deg": [0.0, 20.0, 10.0]}
    mission = planned({"tool": goal, "duration": 4}, robot=robot)
    joints, base = whole(mission)
    assert_consistent(joints, 1.0)
    states = tool_of(find_robot(robot), joints, base, range(0, len(joints), 400))
    first, last = states[0], states[-1]
    np.testing.assert_allclose(last.position - first.position, goal["xyz"], atol=1e-10)
    turn = last.rotation @ first.rotation.T
    wanted = Rotation.from_euler("xyz", goal["rpy_deg"], degrees=True)
    np.testing.assert_allclose(turn, wanted.as_matrix(), atol=1e-10)
    line = np.array(goal["xyz"]) / np.linalg.norm(goal["xyz"])
    axis = wanted.as_rotvec() / wanted.magnitude()
    for state in states:
        way = state.position - first.position
        np.testing.assert_allclose(way, line * (way @ line), atol=1e-9)
        turned = Rotation.from_matrix(state.rotation @ first.rotation.T).as_rotvec()
        np.testing.assert_allclose(turned, axis * (turned @ axis), atol=1e-9)


def test_a_closed_path_returns_the_joints_with_the_attitude_held() -> None:
    sides = ([0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [-0.2, 0.0, 0.0], [0.0, -0.2, 0.0])
    orientation = {"rpy_deg": [0.0, 0.0, 0.0]}
    start = [10.0, 100.0, 200.0, 20.0, 30.0, 10.0]
    square = planned(
        *({"tool": {"xyz": side, **orientation}, "duration": 3} for side in sides),
        waypoints_deg=start,
    )
    joints, _ = whole(square)
    np.testing.assert_allclose(joints[-1, 0], joints[0, 0], rtol=0.0, atol=1e-9)


def test_the_tool_keeps_its_line_while_the_base_turns() -> None:
    goal = {"xyz": [0.2, 0.0, 0.1]}
    mission = planned({"tool": goal, "base": {"rpy_deg": [0, 0, 15]}, "duration": 8})
    joints, base = whole(mission)
    states = tool_of(find_robot("paper"), joints, base, range(0, len(joints), 1000))
    line = np.array(goal["xyz"]) / np.linalg.norm(goal["xyz"])
    for state in states:
        way = state.position - states[0].position
        np.testing.assert_allclose(way, line * (way @ line), atol=1e-9)
    yaw = np.radians(15.0) / 2.0
    np.testing.assert_allclose(base[-1, :4], [np.cos(yaw), 0.0, 0.0, np.sin(yaw)], atol=1e-14)


def momenta(mission: Mission) -> np.ndarray:
    """Angular momentum of the reference, N m s, about the robot's centre of mass."""
    robot = find_robot("paper")
    piece = mission.pieces[0]
    return demand(robot, piece.joints, piece.base, piece.begin, piece.end).stored_momentum


@pytest.mark.parametrize("orientation", [{}, {"rpy_deg": [0.0, 10.0, -10.0]}], ids=["xyz", "pose"])
def test_the_tool_keeps_its_line_while_the_base_is_free(orientation: dict[str, Any]) -> None:
    goal = {"xyz": [0.3, 0.1, -0.2], **orientation}
    mission = planned({"tool": goal, "base": "free", "duration": 10})
    joints, base = whole(mission)
    assert_consistent(joints, 1.0)
    states = tool_of(find_robot("paper"), joints, base, range(0, len(joints), 1000))
    line = np.array(goal["xyz"]) / np.linalg.norm(goal["xyz"])
    for state in states:
        way = state.position - states[0].position
        np.testing.assert_allclose(way, line * (way @ line), atol=1e-9)
    np.testing.assert_allclose(states[-1].position - states[0].position, goal["xyz"], atol=1e-9)
    if orientation:
        wanted = Rotation.from_euler("xyz", orientation["rpy_deg"], degrees=True).as_matrix()
        turn = states[-1].rotation @ states[0].rotation.T
        np.testing.assert_allclose(turn, wanted, atol=1e-9)
    held = planned({"tool": goal, "duration": 10})
    assert momenta(mission).max() < 1e-7 * momenta(held).max()


def test_a_closed_path_does_not_return_the_joints_with_the_base_free() -> None:
    sides = ([0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [-0.2, 0.0, 0.0], [0.0, -0.2, 0.0])
    orientation = {"rpy_deg": [0.0, 0.0, 0.0]}
    square = planned(
        *({"tool": {"xyz": side, **orientation}, "base": "free", "duration": 3} for side in sides),
        waypoints_deg=[10.0, 100.0, 200.0, 20.0, 30.0, 10.0],
    )
    joints, base = whole(square)
    assert np.abs(joints[-1, 0] - joints[0, 0]).max() > np.radians(0.1)
    assert 2.0 * np.linalg.norm(base[-1, 1:4]) > np.radians(0.1)
    robot = find_robot("paper")
    first, last = (tool_state(robot, base[k, :4], joints[k, 0]) for k in (0, -1))
    np.testing.assert_allclose(first.position, last.position, atol=1e-9)
    np.testing.assert_allclose(first.rotation, last.rotation, atol=1e-9)


def test_a_free_base_turns_as_the_area_rule_has_it() -> None:
    """On a small closed path of the joints the turn grows with its area: 4 times by twice the size.

    Vafa & Dubowsky, The kinematics and dynamics of space manipulators, 1990.
    """
    start = np.array(STARTS["paper"])

    def turn(size: float) -> float:
        steps = ([size, 0], [size, size], [0, size], [0, 0])
        goals = (start + np.array([*step, 0, 0, 0, 0]) for step in steps)
        mission = planned(
            *({"joints_deg": list(goal), "base": "free", "duration": 2} for goal in goals)
        )
        _, base = whole(mission)
        return float(np.linalg.norm(base[-1, 1:4]))

    assert turn(2.0) == pytest.approx(4.0 * turn(1.0), rel=0.1)


@pytest.mark.parametrize(("orientation", "share"), [({}, 0.05), ({"rpy_deg": [0, 0, 0]}, 0.6)])
def test_a_tool_is_led_with_the_least_momentum(orientation: dict[str, Any], share: float) -> None:
    goal = {"xyz": [0.2, 0.0, -0.1], **orientation}
    robot, torques = find_robot("seven_joint"), []
    for least in ("motion", "momentum"):
        segment = {"tool": {**goal, "least": least}, "duration": 15}
        mission = planned(segment, robot="seven_joint")
        joints, base = whole(mission)
        states = tool_of(robot, joints, base, range(0, len(joints), 3000))
        way = states[-1].position - states[0].position
        np.testing.assert_allclose(way, goal["xyz"], atol=1e-10)
        piece = mission.pieces[0]
        asked = demand(robot, piece.joints, piece.base, piece.begin, piece.end)
        torques.append(asked.base_torque.max())
    assert torques[1] < share * torques[0]


def test_a_bent_leg_ends_where_a_straight_one_does() -> None:
    goal = [15.0, 110.0, 185.0, 45.0, 10.0, -25.0]
    bends = [[4.0, 3.0, 12.0, -6.0, 17.0, -2.0], [0.0, 0.0, 1.0, -2.0, 4.0, -1.0]]
    bent, _ = whole(planned({"joints_deg": goal, "bends_deg": bends, "duration": 5}))
    straight, _ = whole(planned({"joints_deg": goal, "duration": 5}))
    assert_consistent(bent, 1.0)
    for k in (0, -1):
        np.testing.assert_allclose(bent[k], straight[k], rtol=0.0, atol=1e-15)
    middle = np.degrees(bent[5_000, 0] - straight[5_000, 0])
    np.testing.assert_allclose(middle, bends[0], atol=1e-12)


def test_frames_of_a_goal() -> None:
    robot = find_robot("paper")
    start = tool_state(robot, [1.0, 0.0, 0.0, 0.0], np.radians(STARTS["paper"]))
    on_base = start.position + start.centre_of_mass
    wanted = on_base + np.array([0.1, 0.05, -0.1])
    inertial = planned({"tool": {"xyz": wanted.tolist(), "frame": "inertial"}, "duration": 5})
    joints, base = whole(inertial)
    end = tool_state(robot, base[-1, :4], joints[-1, 0])
    np.testing.assert_allclose(end.position + start.centre_of_mass, wanted, atol=1e-10)
    of_base = {"xyz": wanted.tolist(), "frame": "base"}
    turned = planned({"tool": of_base, "base": {"rpy_deg": [0, 0, 10]}, "duration": 5})
    joints, base = whole(turned)
    end = tool_state(robot, base[-1, :4], joints[-1, 0])
    axes = Rotation.from_quat(np.roll(base[-1, :4], -1)).as_matrix()
    np.testing.assert_allclose(axes.T @ (end.position + end.centre_of_mass), wanted, atol=1e-10)


def test_slew_of_the_base_is_a_rotation_with_its_own_rates() -> None:
    mission = planned({"base": {"rpy_deg": [10, 20, -30]}, "duration": 4})
    _, base = whole(mission)
    attitude = Rotation.from_quat(np.roll(base[:, :4], -1, axis=1))
    steps = (attitude[:-2].inv() * attitude[2:]).as_rotvec() / (2.0 * PERIOD)
    np.testing.assert_allclose(base[1:-1, 4:7], steps, atol=1e-6)
    rates = (base[2:, 4:7] - base[:-2, 4:7]) / (2.0 * PERIOD)
    np.testing.assert_allclose(base[1:-1, 7:], rates, atol=1e-5)
    expected = Rotation.from_euler("xyz", [10, 20, -30], degrees=True)
    assert (attitude[-1].inv() * expected).magnitude() < 1e-12


def test_reactionless_motion_leaves_the_base_alone() -> None:
    goal = [40.0, 10.0, 55.0, 80.0, 30.0, 85.0, 100.0]
    free = planned({"reactionless": {"joints_deg": goal}, "duration": 10}, robot="seven_joint")
    robot = find_robot("seven_joint")
    piece = free.pieces[0]
    reached = robot.to_degrees(piece.goal).tolist()
    plain = planned({"joints_deg": reached, "duration": 10}, robot="seven_joint").pieces[0]
    asked, usual = (
        demand(robot, p.joints, p.base, p.begin, p.end).base_torque.max() for p in (piece, plain)
    )
    assert asked < 0.01 * usual
    start = np.array(STARTS["seven_joint"])
    way, left = np.array(reached) - start, np.array(goal) - reached
    assert np.linalg.norm(way) > 5.0
    # what is left of the way has no part in the null space any more
    coupling = tool_state(robot, [1.0, 0.0, 0.0, 0.0], piece.goal).coupling
    _, _, rows = np.linalg.svd(coupling)
    assert np.linalg.norm(rows[3:] @ left) < 1e-6 * np.linalg.norm(left)


@pytest.mark.parametrize(
    ("limits", "quantity", "limit"),
    [({"base_torque": 1.5}, "base_torque", 1.5), ({"base_momentum": 4.0}, "stored_momentum", 4.0)],
)
def test_a_fast_segment_comes_to_its_limit(
    limits: dict[str, float], quantity: str, limit: float
) -> None:
    goal = [15, 110, 185, 45, 10, -25]
    mission = planned({"joints_deg": goal, "duration": "fast"}, limits=limits)
    piece = mission.pieces[0]
    asked = demand(find_robot("paper"), piece.joints, piece.base, piece.begin, piece.end)
    assert getattr(asked, quantity).max() == pytest.approx(limit, rel=1e-3)


def test_trajectories_of_files(tmp_path: Path) -> None:
    time = np.linspace(0.0, 5.0, 51)
    robot = find_robot("paper")
    start = np.radians(STARTS["paper"])
    share = (time / 5.0) ** 3 * (10.0 + time / 5.0 * (-15.0 + 6.0 * time / 5.0))
    rows = start + share[:, np.newaxis] * np.radians([20, -10, 5, 10, 0, 5])
    lines = [",".join(("time", *robot.joint_names, "note"))]
    numbers = np.column_stack((time, rows, np.zeros(len(time)))).tolist()
    lines += [",".join(map(repr, row)) for row in numbers]
    (tmp_path / "path.csv").write_text("\n".join(lines))
    text = with_columns(json.dumps({"file": "path.csv"}), tmp_path)
    mission = Mission(
        robot, MissionSettings(waypoints_deg=STARTS["paper"], segments=[text]), PERIOD
    )
    joints, _ = whole(mission)
    assert_consistent(joints, 1.0)
    np.testing.assert_allclose(joints[::200, 0], rows, atol=1e-12)


@pytest.mark.parametrize("base", ["free", {"rpy_deg": [0, 0, 5]}], ids=["free", "led"])
def test_a_long_segment_is_the_same_path_with_no_more_knots(base: Any) -> None:
    segments = [{"tool": {"xyz": [0.1, 0.0, -0.1]}, "base": base, "duration": d} for d in (9, 9e5)]
    (short,), (long,) = (planned(segment).pieces for segment in segments)
    # where joints are left over, their share depends on the knots a little
    np.testing.assert_allclose(long.goal, short.goal, atol=1e-5)
    np.testing.assert_allclose(long.attitude, short.attitude, atol=1e-6)
    assert len(knots(long.end)) == len(sample_times(long.begin, long.end)) == MOST_KNOTS


def test_a_day_of_hold_is_planned_and_all_together_stay_below_a_length() -> None:
    assert planned({"hold": 86_400}).duration == 86_400.0
    with pytest.raises(InputError, match=r"segment 2: all together last more than 1e.06 s"):
        planned({"hold": 6e5}, {"hold": 6e5})


def test_limits_that_would_take_too_long_are_named() -> None:
    segment = {"joints_deg": [1.0, 120.0, 220.0, 0.0, -10.0, 0.0], "duration": "fast"}
    with pytest.raises(InputError, match=r"to keep to base_momentum, at most 1e.06 s"):
        planned(segment, limits={"base_momentum": 1e-12})
    with pytest.raises(InputError, match="takes inf s to keep to base_torque"):
        planned(segment, limits={"base_torque": 5e-324})


@pytest.mark.parametrize(
    ("times", "degrees"),
    [([0.0, 1e300], 1.0), ([0.0, 1e-300], 1.0), ([0.0, 10.0], 1e300), ([0.0], 1e300)],
)
@pytest.mark.filterwarnings("error")
def test_waypoints_that_cannot_be_flown_are_refused(times: list[float], degrees: float) -> None:
    rows = [[degrees + k] * 6 for k in range(len(times))]
    settings = MissionSettings(waypoint_times=times, waypoints_deg=np.ravel(rows).tolist())
    with pytest.raises(InputError, match=r"was expected, got|can be flown"):
        Mission(find_robot("paper"), settings, PERIOD)


TOOL = {"xyz": [0.1, 0.0, 0.0]}
BAD: list[tuple[dict[str, Any] | str, str]] = [
    ({"hold": 2, "bends_deg": [[1] * 6]}, "bends_deg needs joints_deg"),
    ({"joints_deg": [0] * 6, "bends_deg": [[1]], "duration": 5}, "bends_deg: 6 values were"),
    ({"base": "free", "duration": 5}, "give one of joints_deg"),
    ({"hold": 5, "base": "free"}, "base: free needs joints_deg or tool"),
    ({"tool": {"xyz": [9, 9, 9]}, "base": "free", "duration": 5}, "with the base free"),
    ({"tool": {"xyz": [0, 0, 0.1], "least": "time"}, "duration": 5}, "tool.least"),
    ({}, "give one of joints_deg, tool"),
    ("[1, 2]", "segment 1: "),
    ("{tool: [", "segment 1: "),
    ({"joints": [1]}, "joints: unknown key"),
    ({"joints_deg": [1, 2], "duration": 2}, "joints_deg: 6 values were expected, got 2"),
    ({"joints_deg": STARTS["paper"]}, r"give duration \(s\), or duration: fast"),
    ({"joints_deg": STARTS["paper"], "duration": 0}, "greater than or equal to 0.000001"),
    ({"joints_deg": STARTS["paper"], "duration": -1}, "greater than or equal to 0.000001"),
    ({"joints_deg": STARTS["paper"], "duration": "quick"}, "duration"),
    ({"joints_deg": STARTS["paper"], "duration": 2, "fast": True}, "give duration"),
    ({"joints_deg": ["a"] * 6, "duration": 2}, "joints_deg"),
    ({"joints_deg": STARTS["paper"], "tool": TOOL, "duration": 2}, "a segment has one of them"),
    ({"hold": 1, "duration": 2}, "hold has its own"),
    ({"hold": 0}, "greater than or equal to 0.000001"),
    ({"base": {"rpy_deg": [1e300, 0, 0]}, "duration": 5}, "less than or equal to 36000"),
    ({"reactionless": {}, "duration": 5}, r"{joints_deg: \[...\]} was expected, got {}"),
    ({"hold": 1, "base": "free"}, "base: free needs joints_deg or tool"),
    ({"hold": float("inf")}, "hold"),
    ({"tool": {}, "duration": 2}, "give xyz, rpy_deg or quaternion"),
    ({"tool": {"xyz": [1, 2]}, "duration": 2}, "xyz"),
    ({"tool": {"xyz": [1, 2, "z"]}, "duration": 2}, "xyz"),
    ({"tool": {**TOOL, "frame": "world"}, "duration": 2}, "frame"),
    ({"tool": {**TOOL, "link": "hand"}, "duration": 2}, "'hand': choose one of"),
    ({"tool": {**TOOL, "quaternion": [0, 0, 0, 0]}, "duration": 2}, "norm of 0.001 to 1000"),
    ({"tool": {**TOOL, "quaternion": [1, 0, 0]}, "duration": 2}, "quaternion"),
    (
        {"tool": {"rpy_deg": [0, 0, 1], "quaternion": [1, 0, 0, 0]}, "duration": 2},
        "rpy_deg and quaternion were given",
    ),
    ({"tool": {"xyz": [20, 0, 0]}, "duration": 5}, "cannot follow its path beyond t = "),
    ({"tool": {"xyz": [0, 0, -20]}, "duration": 5}, "m from its goal: out of reach"),
    ({"base": {}, "duration": 2}, "give rpy_deg or quaternion"),
    ({"base": {"rpy_deg": [0, 0]}, "duration": 2}, "rpy_deg"),
    ({"base": {"xyz": [0, 0, 0]}, "duration": 2}, "unknown key"),
    ({"base": {"rpy_deg": [0, 0, 10]}}, "give duration"),
    ({"base": {"rpy_deg": [0, 0, 10]}, "duration": "fast"}, "no limit of velocity"),
    ({"reactionless": {"joints_deg": [1]}, "duration": 2}, "6 values were expected, got 1"),
    ({"reactionless": {"joints": [1]}, "duration": 2}, "reactionless"),
    ({"reactionless_deg": STARTS["paper"]}, "give duration"),
    ({"file": "nowhere.csv"}, "nowhere.csv"),
    ({"file": "nowhere.csv", "duration": 2}, "has its own duration"),
    ({"trajectory": {"time": [0, 1]}}, "column 'joint1' is missing"),
    ({"trajectory": {"time": [0, 1]}, "base": {"rpy_deg": [0, 0, 1]}}, "cannot be combined"),
    # numbers that are too large or too small
    ({"hold": 1e7}, "less than or equal to 1000000"),
    ({"joints_deg": [1e300] * 6, "duration": 10}, "'joint1': at most 572958 degrees can be flown"),
    ({"joints_deg": [1.0] * 6, "duration": 1e-300}, "greater than or equal to 0.000001"),
    ({"joints_deg": [1.0] * 6, "duration": 1e-5}, "moves at .* degrees/s at t = .* can be flown"),
    ({"base": {"rpy_deg": [0, 0, 10]}, "duration": 1e-3}, r"the base turns at .* rad/s at t ="),
    ({"tool": {"xyz": [1e300, 0, 0]}, "duration": 5}, "cannot follow its path"),
    ({"reactionless": {"joints_deg": [1e300] * 6}, "duration": 5}, "at most 572958 degrees"),
    ({"reactionless": {"joints_deg": [5e3] * 6}, "duration": 5}, "'joint5' is .* m away, at most"),
    ({"joints_deg": STARTS["paper"], "bends_deg": [[1] * 6] * 101, "duration": 5}, "at most 100"),
]


@pytest.mark.parametrize(("segment", "said"), BAD, ids=range(len(BAD)))
@pytest.mark.filterwarnings("error")
def test_what_cannot_be_flown_is_refused_in_one_line(
    segment: dict[str, Any] | str, said: str
) -> None:
    text = segment if isinstance(segment, str) else json.dumps(segment)
    with pytest.raises(InputError, match=said) as caught:
        planned_text(text)
    assert "\n" not in str(caught.value)
    assert "segment 1" in str(caught.value)


def planned_text(text: str) -> Mission:
    settings = MissionSettings(waypoints_deg=STARTS["paper"], segments=[text])
    return Mission(find_robot("paper"), settings, PERIOD)


def trajectory(**changes: Any) -> str:
    start = np.radians(STARTS["paper"])
    columns: dict[str, Any] = {"time": [0.0, 1.0, 2.0]}
    columns |= {f"joint{j + 1}": [start[j], start[j] + 0.01, start[j] + 0.02] for j in range(6)}
    return json.dumps({"trajectory": columns | changes})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"time": [0.0, 1.0, 1.0]}, "time must rise, got 1 s after 1 s"),
        ({"joint2": [0.0, 0.0, 0.0]}, "joint 2 begins at 0, the mission is at 2.0944 then"),
        ({"joint1_rate": [0.0, 1.0, 0.0]}, "joint1_rate is 1 at 1 s, the positions of joint1"),
        ({"q_w": [1.0, 1.0, 1.0]}, "q_w without the rest of a quaternion"),
        ({f"q_{k}": [0.6] * 3 for k in "wxyz"}, "row 1: the quaternion has a norm of 1.2"),
        (
            {"q_w": [0.0] * 3, "q_x": [1.0] * 3, "q_y": [0.0] * 3, "q_z": [0.0] * 3},
            "the base begins with another attitude",
        ),
        ({"time": [0.0]}, "2 to 100000 rows were expected, got 1"),
        ({"joint3": [0.0]}, "joint3 has 1 values, 3 were expected"),
        ({"joint1_rate": []}, "joint1_rate has 0 values, 3 were expected"),
        ({"time": [0.0, 1.0, 1.0 + 1e-9]}, "time must rise, got 1.000000001 s after 1 s"),
        ({"time": [0.0, 1.0, 1e7]}, r"a duration of 1e-06 to 1e.06 s .11 days. was expected"),
        ({"time": [-1e308, 0.0, 1e308]}, "got inf s"),
        ({"joint1": [0.0, 1e308, 0.0]}, r"joint1 is 1e.308 at 1 s, at most 10000 .rad or m."),
        ({"time": [0.0, 1e-4, 2.0]}, "joint 'joint1' moves at .* at most 5730 can be flown"),
    ],
)
def test_bad_trajectories_are_refused_in_one_line(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        planned_text(trajectory(**changes))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "the file is empty"),
        ("time,joint1\n0.0\n", "line 2: 2 cells expected, got 1"),
        ("time,joint1\n0.0,abc\n", "line 2: joint1: a number was expected, got 'abc'"),
        ("time,joint1\n0.0,nan\n", "line 2: joint1: a number was expected, got 'nan'"),
    ],
)
def test_bad_files_are_named_with_line_and_column(tmp_path: Path, content: str, said: str) -> None:
    (tmp_path / "path.csv").write_text(content)
    with pytest.raises(InputError, match=rf"path.csv: {said}"):
        with_columns("{file: path.csv}", tmp_path)
