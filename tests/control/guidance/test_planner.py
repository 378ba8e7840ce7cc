"""Plans of segments: tool, joints and base do what was asked for, or it is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from paths import DATA
from scipy.spatial.transform import Rotation
from strategies import random_robot

from space_robot_control.guidance.demand import MotionDemand, demand
from space_robot_control.guidance.mission import Mission, MissionSettings, with_columns
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
    start = {"joints_deg": STARTS[robot], "segments": texts, **settings}
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


def demand_of(mission: Mission, robot: str = "paper") -> MotionDemand:
    """The demand of the first segment."""
    piece = mission.pieces[0]
    return demand(find_robot(robot), piece.joints, piece.base, piece.begin, piece.end)


POSE = {"xyz": [0.2, 0.1, -0.15], "rpy_deg": [0.0, 20.0, 10.0]}
PATHS = [
    ("paper", POSE, None),
    ("seven_joint", POSE, None),
    ("paper", {"xyz": [0.2, 0.0, 0.1]}, {"rpy_deg": [0, 0, 15]}),
    ("paper", {"xyz": [0.3, 0.1, -0.2]}, "free"),
    ("paper", {"xyz": [0.3, 0.1, -0.2], "rpy_deg": [0.0, 10.0, -10.0]}, "free"),
]


@pytest.mark.parametrize(("robot", "goal", "of_base"), PATHS)
def test_a_tool_goes_straight_and_turns_about_one_axis(
    robot: str, goal: dict[str, Any], of_base: Any
) -> None:
    """Whether the base is held, turns, or is free: then the robot keeps its momentum of zero."""
    segment = {"tool": goal, "duration": 10 if of_base == "free" else 4}
    mission = planned({**segment, **({"base": of_base} if of_base else {})}, robot=robot)
    joints, base = whole(mission)
    assert_consistent(joints, 1.0)
    states = tool_of(find_robot(robot), joints, base, range(0, len(joints), 400))
    first = states[0]
    line = np.array(goal["xyz"]) / np.linalg.norm(goal["xyz"])
    np.testing.assert_allclose(states[-1].position - first.position, goal["xyz"], atol=1e-9)
    for state in states:
        way = state.position - first.position
        np.testing.assert_allclose(way, line * (way @ line), atol=1e-9)
    if "rpy_deg" in goal:
        wanted = Rotation.from_euler("xyz", goal["rpy_deg"], degrees=True)
        turns = [Rotation.from_matrix(state.rotation @ first.rotation.T) for state in states]
        np.testing.assert_allclose(turns[-1].as_matrix(), wanted.as_matrix(), atol=1e-9)
        axis = wanted.as_rotvec() / wanted.magnitude()
        for turned in (turn.as_rotvec() for turn in turns):
            np.testing.assert_allclose(turned, axis * (turned @ axis), atol=1e-8)
    if of_base == "free":
        held = demand_of(planned(segment)).stored_momentum.max()
        assert demand_of(mission).stored_momentum.max() < 1e-7 * held
    elif of_base:
        yaw = np.radians(15.0) / 2.0
        np.testing.assert_allclose(base[-1, :4], [np.cos(yaw), 0, 0, np.sin(yaw)], atol=1e-14)


def test_joints_move_with_the_base_free_without_momentum() -> None:
    segment = {"joints_deg": [20.0, 100.0, 230.0, 10.0, 0.0, 5.0], "duration": 4}
    free, held = planned({**segment, "base": "free"}), planned(segment)
    momenta = [demand_of(mission).stored_momentum.max() for mission in (free, held)]
    assert momenta[0] < 1e-7 * momenta[1]
    np.testing.assert_allclose(whole(free)[0][-1], whole(held)[0][-1], atol=1e-12)


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
        torques.append(demand_of(mission, "seven_joint").base_torque.max())
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


def test_reactionless_motion_leaves_the_base_alone() -> None:
    goal = [40.0, 10.0, 55.0, 80.0, 30.0, 85.0, 100.0]
    free = planned({"reactionless": {"joints_deg": goal}, "duration": 10}, robot="seven_joint")
    robot, piece = find_robot("seven_joint"), free.pieces[0]
    reached = robot.to_degrees(piece.goal).tolist()
    plain = planned({"joints_deg": reached, "duration": 10}, robot="seven_joint")
    asked, usual = (demand_of(m, "seven_joint").base_torque.max() for m in (free, plain))
    assert asked < 0.01 * usual
    way, left = np.array(reached) - STARTS["seven_joint"], np.array(goal) - reached
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
    assert getattr(demand_of(mission), quantity).max() == pytest.approx(limit, rel=1e-3)


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
    mission = Mission(robot, MissionSettings(joints_deg=STARTS["paper"], segments=[text]), PERIOD)
    joints, _ = whole(mission)
    assert_consistent(joints, 1.0)
    np.testing.assert_allclose(joints[::200, 0], rows, atol=1e-12)


def test_a_day_of_hold_is_planned() -> None:
    assert planned({"hold": 86_400}).duration == 86_400.0


# Refused in one line: rows of tests/data/refusals/guidance.yaml


AT = STARTS["paper"]
TEXT = (DATA / "refusals/guidance.yaml").read_text("utf-8")
ROWS: list[dict[str, Any]] = yaml.safe_load(TEXT.replace("START", str(AT)))
MANY = {"joints_deg": AT, "bends_deg": [[1] * 6] * 101, "duration": 5}
ROWS.append({"segments": [MANY], "said": "at most 100"})
ISS = {"orbital_elements": {"height": 420e3, "eccentricity": 0.0005, "inclination_deg": 51.64}}


def flown_robot(name: str | int) -> Robot:
    if isinstance(name, int):
        return random_robot(np.random.default_rng(name), name)
    own = DATA / name / "robot.yaml"
    return Robot.from_yaml(own) if own.exists() else find_robot(name)


def columns_of(changes: dict[str, Any]) -> str:
    columns: dict[str, Any] = {"time": [0.0, 1.0, 2.0]}
    for k, angle in enumerate(np.radians(AT), 1):
        columns[f"joint{k}"] = [angle, angle + 0.01, angle + 0.02]
    return json.dumps({"trajectory": columns | changes})


def as_text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["said"])
@pytest.mark.filterwarnings("error")
def test_a_mission_is_refused_in_one_line(row: dict[str, Any]) -> None:
    """InputError and Pydantic's ValidationError are both ValueErrors."""
    settings = {"joints_deg": AT} | row
    robot, said = flown_robot(settings.pop("robot", "paper")), settings.pop("said")
    if settings.pop("orbit", False):
        settings["assumed_orbit"] = ISS
    segments = [as_text(segment) for segment in settings.pop("segments", [])]
    if changes := settings.pop("columns", None):
        segments = [columns_of(changes)]
    if "base_point" in settings:
        settings["base_point"] = as_text(settings["base_point"])
    with pytest.raises(ValueError, match=said) as caught:
        Mission(robot, MissionSettings(segments=segments, **settings), PERIOD)
    if isinstance(caught.value, InputError):
        assert "\n" not in str(caught.value)
        assert "segment" in str(caught.value) or not segments or "base" in str(caught.value)


@pytest.mark.parametrize("base", [{}, {"base": "free"}], ids=["held", "free"])
def test_a_closed_path_returns_the_joints_with_the_attitude_held_alone(base: Any) -> None:
    sides = ([0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [-0.2, 0.0, 0.0], [0.0, -0.2, 0.0])
    pose = {"rpy_deg": [0.0, 0.0, 0.0]}
    square = planned(
        *({"tool": {"xyz": side, **pose}, "duration": 3, **base} for side in sides),
        joints_deg=[10.0, 100.0, 200.0, 20.0, 30.0, 10.0],
    )
    joints, attitudes = whole(square)
    if base:
        assert np.abs(joints[-1, 0] - joints[0, 0]).max() > np.radians(0.1)
        assert 2.0 * np.linalg.norm(attitudes[-1, 1:4]) > np.radians(0.1)
        robot = find_robot("paper")
        first, last = (tool_state(robot, attitudes[k, :4], joints[k, 0]) for k in (0, -1))
        np.testing.assert_allclose(first.position, last.position, atol=1e-9)
        np.testing.assert_allclose(first.rotation, last.rotation, atol=1e-9)
    else:
        np.testing.assert_allclose(joints[-1, 0], joints[0, 0], rtol=0.0, atol=1e-9)
