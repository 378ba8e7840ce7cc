"""The tool's error on its path: zero if all is as the reference, else what it is moved by."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import CONFIG
from scipy.spatial.transform import Rotation
from strategies import random_quaternion, random_robot

import space_robot as sr
from space_robot.analysis.described import assumed_robot_of, captures_of
from space_robot.analysis.tool_error import ToolError, ToolPath, leads_tool
from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.tool import tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.orbit_settings import OrbitSettings

TICKS = 5
SEEDS = st.integers(0, 2**31 - 1)


def on_its_path(robot: Robot, seed: int) -> FlightLog:
    """A log that is on its reference, and whose centre of mass does not move."""
    rng = np.random.default_rng(seed)
    log = FlightLog.allocate(TICKS, robot.joint_names, Timebase(500_000))
    log.reference_base[:] = 0.0
    log.reference_base[:, :4] = [random_quaternion(rng) for _ in range(TICKS)]
    log.reference_joints[:] = rng.uniform(-3.0, 3.0, (TICKS, 3, robot.n))
    log.quaternion[:] = log.reference_base[:, :4]
    log.joint_positions[:] = log.reference_joints[:, 0]
    still = np.zeros((TICKS, 3)), np.zeros((TICKS, robot.n))
    motion = Motion(log.quaternion, still[0], log.joint_positions, still[1])
    log.base_position[:] = rng.normal(size=3) - robot_momentum(robot, motion).centre_of_mass
    return log


@settings(max_examples=40)
@given(SEEDS, st.integers(1, 8))
def test_a_displaced_and_turned_base_displaces_and_turns_the_tool(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, n)
    log = on_its_path(robot, seed)
    metric = ToolError(log, Captures([], robot, 5e-4, OrbitSettings()), robot)
    np.testing.assert_allclose(metric.errors(log), 0.0, atol=1e-12)
    shift, angle = rng.normal(size=3), 0.3
    turn = Rotation.from_rotvec([0.0, 0.0, angle])
    log.base_position[1:] += shift  # with the whole robot, and so with the path
    np.testing.assert_allclose(metric.errors(log), 0.0, atol=1e-12)
    metric.add(log, np.empty(0))
    assert metric.result()["drift_m"] == pytest.approx(np.linalg.norm(shift))
    attitude = turn * Rotation.from_quat(np.roll(log.quaternion, -1, axis=1))
    log.quaternion[:] = np.roll(attitude.as_quat(), 1, axis=1)
    np.testing.assert_allclose(metric.errors(log)[:, 1], angle, rtol=1e-9)


@pytest.mark.parametrize("frame", ["inertial", "base"])
def test_a_panel_on_one_side_does_not_displace_the_tool(frame: str) -> None:
    """A locked panel moves the base's centre of mass, not the frame that goals are given in."""
    goal = [1.8, 0.2, 0.3]
    panels = yaml.safe_load((CONFIG / "robots/flexible_panels.yaml").read_text())
    links = panels["robot"]["links"]
    panels["robot"]["links"] = [x for x in links if not x["name"].startswith("right")]
    segments = [{"tool": {"xyz": goal, "frame": frame}, "duration": 3}]
    flown = sr.Scenario(
        robot=panels,
        mission={"start": {"joints_deg": [10, -60, 120]}, "segments": segments},
        controller="ctc",
        gains=str(CONFIG / "gains/flexible_panels/tuned/ctc.yaml"),
        friction=False,
        case="1",
        duration=4,
    ).fly()
    log = flown.log
    _, place = tool_pose(flown.flight.robot, log.quaternion[-1:], log.all_positions[-1:])
    if frame == "inertial":
        place += log.base_position[-1]
    np.testing.assert_allclose(place[0], goal, atol=2e-5)
    assert flown.report()["tool"]["largest_m"] < 2e-5


def test_in_orbit_the_path_is_that_of_the_free_centre_of_mass() -> None:
    """Drag moves the robot from the origin in free fall, and the tool not from its path."""
    segments = [{"joints_deg": [5, 120, 220, 0, -10, 0], "duration": 5}, {"hold": 15}]
    flown = sr.Scenario(
        mission={"start": {"joints_deg": [0, 120, 220, 0, -10, 0]}, "segments": segments},
        controller="ctc",
        friction=False,
        case="1",
        orbit="iss",
        parameters={"plant": {"atmosphere.density": 1e-8}},
    ).fly()
    tool = flown.report()["tool"]
    assert tool["drift_m"] > 1e-2
    assert tool["largest_m"] < 1e-5


def test_a_capture_moves_the_path_only_from_then_on() -> None:
    segments = [{"joints_deg": [5, 120, 220, 0, -10, 0], "duration": 1}]
    log = (
        sr.Scenario(
            mission={"start": {"joints_deg": [0, 120, 220, 0, -10, 0]}, "segments": segments},
            controller="ctc",
            friction=False,
            case="1",
            duration=2,
            events=["capture@1:tumbling_satellite"],
        )
        .fly()
        .log
    )
    path = ToolPath(log, captures_of(log), assumed_robot_of(log))
    parts = [path.poses(log.rows(*part))[2] for part in [(0, 1200), (1200, 2000), (2000, 4000)]]
    drift = np.concatenate(parts)
    np.testing.assert_allclose(drift[:2001], 0.0, atol=1e-9)
    per_tick = np.diff(drift[2000:], axis=0)
    assert np.linalg.norm(per_tick[0]) > 1e-7
    np.testing.assert_allclose(per_tick, np.broadcast_to(per_tick[0], per_tick.shape), atol=1e-10)


def test_a_line_is_flown_within_a_micrometre_and_a_payload_moves_it() -> None:
    start, goal = [0, 90, 200, 20, 30, 10], {"xyz": [0.3, 0.0, -0.4], "rpy_deg": [0, 0, 0]}
    mission = {"start": {"joints_deg": start}, "segments": [{"tool": goal, "duration": 2}]}
    flown = sr.Scenario(controller="ctc", mission=mission, friction=False, case="1").fly()
    tool = flown.report()["tool"]
    assert tool["rms_m"] <= tool["largest_m"] < 1e-6
    assert tool["rms_deg"] <= tool["largest_deg"] < 1e-5
    loaded = sr.Scenario(
        controller="ctc", mission=mission, friction=False, case={"payload": {"mass": 20.0}}
    )
    assert loaded.fly().report()["tool"]["largest_m"] > 1e-3
    plain = sr.Scenario(duration=0.1).fly().log  # waypoints lead no tool
    assert not leads_tool(plain)
    for column in (plain.reference_joints[-1, 0], plain.reference_base[-1, :4]):
        before = column.copy()
        column += 0.01  # unless changed in flight
        assert leads_tool(plain)
        column[:] = before
