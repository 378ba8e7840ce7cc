"""Pointing errors of end effector and base by SciPy's rotations, and the tool's on its path."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import quaternion_of, rotation_of
from paths import CONFIG
from scipy.spatial.transform import Rotation
from strategies import random_quaternion, random_robot

import space_robot as sr
from space_robot import Scenario
from space_robot.analysis import analyze, measure
from space_robot.analysis.analysed_log import ANGLES, AnalysedLog, PointingBudget, pointed_axis
from space_robot.analysis.errors import attitude_error, rotation_vectors
from space_robot.analysis.pointing import ARCSEC, end_effector, errors
from space_robot.analysis.tool_path import ToolPath, leads_tool
from space_robot.analysis.words import remarks
from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase
from space_robot_sim.plant.settings import PlantNodeSettings

SEEDS = st.integers(0, 2**32 - 1)


def log_of(robot: Robot, rng: np.random.Generator, size: float, ticks: int = 4) -> FlightLog:
    """Random desired states, and measured ones that are off by rotations of about ``size`` rad."""
    log = FlightLog.allocate(ticks, robot.joint_names, Timebase(500_000))
    log.reference_base[:] = 0.0
    desired = np.array([random_quaternion(rng) for _ in range(ticks)])
    off = Rotation.from_rotvec(size * rng.uniform(-1.0, 1.0, (ticks, 3)))
    log.reference_base[:, :4] = desired
    for k in range(ticks):
        log.quaternion[k] = quaternion_of(off[k] * rotation_of(desired[k]))
    log.reference_joints[:] = rng.uniform(-np.pi, np.pi, (ticks, 3, robot.n))
    log.joint_positions[:] = log.reference_joints[:, 0]
    log.joint_positions += size * rng.uniform(-1.0, 1.0, (ticks, robot.n))
    log.base_position[:] = rng.normal(size=(ticks, 3))
    return log


def sizes_of(group: Any, log: FlightLog, robot: Robot, axis: Any = None) -> dict[str, Any]:
    """Of each column of a series; angles in rad."""
    flight = AnalysedLog(log, None if axis is None else PointingBudget(axis=list(axis)))
    flight.robot = robot
    ((_, sizes),) = group.sizes(flight)
    units = {name: ARCSEC if group.quantity(name).unit == "arcsec" else 1.0 for name in sizes}
    return {name: units[name] * size for name, size in sizes.items()}


@given(SEEDS, st.sampled_from([0.0, 1e-9, 1e-4, 1.0, 3.0]))
def test_angles_are_scipys(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 6)
    log = log_of(robot, rng, size)
    error = sizes_of(end_effector, log, robot)
    actual, place = tool_pose(robot, log.quaternion, log.joint_positions)
    desired, wanted = tool_pose(robot, log.reference_base[:, :4], log.reference_joints[:, 0])
    for k in range(log.ticks):
        between = Rotation.from_matrix(actual[k] @ desired[k].T)
        assert error["tool_attitude"][k] == pytest.approx(between.magnitude(), rel=1e-6, abs=1e-14)
        across = np.linalg.norm(np.cross(actual[k, :, 2], desired[k, :, 2]))
        angle = np.arctan2(across, actual[k, :, 2] @ desired[k, :, 2])
        assert error["boresight"][k] == pytest.approx(angle, rel=1e-6, abs=1e-14)
        assert error["boresight"][k] <= error["tool_attitude"][k] * (1.0 + 1e-6) + 1e-13
        assert error["tool_position"][k] == pytest.approx(np.linalg.norm(place[k] - wanted[k]))


def test_a_roll_is_rotation_but_not_pointing_and_the_bases_drift_is_told_apart(
    paper_robot: Robot,
) -> None:
    log = log_of(paper_robot, np.random.default_rng(1), 0.0)
    log.joint_positions[:, -1] += 0.01  # the paper's tool lies along the last joint's axis
    log.base_position[:] = [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 4.0, 5.0], [1.0, 1.0, 3.0]]
    flight = AnalysedLog(log)
    flight.robot = paper_robot
    found = end_effector.evaluate(flight, range(log.ticks))
    drift = [found[f"base_drift.{key}"] for key in ("rms", "max", "end")]
    assert drift == pytest.approx([np.sqrt(7.25), 5.0, 2.0])
    for name, size in (("boresight", 0.0), ("tool_position", 0.0), ("tool_attitude", 0.01)):
        size /= 1.0 if name == "tool_position" else ARCSEC
        assert found[f"{name}.max"] == pytest.approx(size, rel=1e-9, abs=1e-7)


MISSIONS = [
    (['{"hold": 5}', "{base: {point: nadir, axis: [0, 3, 4]}, duration: 10}"], (0.0, 0.6, 0.8)),
    (["{base: {point: sun}, hold: 9}", "{base: {point: nadir, axis: [1, 0, 0]}}"], (0, 0, 1)),
    (["{base: {rpy_deg: [0, 0, 90]}, duration: 9}"], (0.0, 0.0, 1.0)),
    (["{base: {point: nadir, axis: [0, 0, 0]}}", "{base: {point: x, axis: abc}}"], (0, 0, 1)),
    (["{", "5", "base: free"], (0.0, 0.0, 1.0)),
    ([], (0.0, 0.0, 1.0)),
]


@given(SEEDS, st.sampled_from([1e-9, 1e-4, 1.0]))
def test_the_bases_angles_are_those_of_its_directions(seed: int, size: float) -> None:
    """By SciPy: the axis' directions, and the twist left when the shortest turn aligned these."""
    rng = np.random.default_rng(seed)
    log, axis = log_of(random_robot(rng, 1), rng, size), rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    found = sizes_of(errors, log, random_robot(rng, 1), axis)
    vectors = rotation_vectors(attitude_error(log))
    for k in range(log.ticks):
        turned = rotation_of(log.reference_base[k, :4]).inv() * rotation_of(log.quaternion[k])
        away = turned.apply(axis)
        across = np.cross(axis, away)
        half_cone = np.arctan2(np.linalg.norm(across), axis @ away)
        assert found["half_cone"][k] == pytest.approx(half_cone, rel=1e-9, abs=1e-15)
        swing = Rotation.from_rotvec(across / max(np.linalg.norm(across), 1e-300) * half_cone)
        twist = (swing.inv() * turned).as_rotvec()
        assert found["about_axis"][k] == pytest.approx(abs(twist @ axis), rel=1e-9, abs=1e-15)
        np.testing.assert_allclose(np.cross(twist, axis), 0.0, atol=1e-12)
        assert found["base_rotation"][k] == pytest.approx(turned.magnitude(), rel=1e-12, abs=1e-15)
        np.testing.assert_allclose(vectors[k], turned.as_rotvec(), rtol=1e-9, atol=1e-15)


def test_the_bases_figures_are_those_of_plain_loops() -> None:
    """Band, windows that follow one another, and jitter as the difference from their means."""
    rng, ticks, window = np.random.default_rng(1), 1030, 100
    log = log_of(random_robot(rng, 1), rng, 1e-3, ticks)
    axis = np.array([0.0, 0.6, 0.8])
    budget = PointingBudget(band_deg=0.03, window_s=window * 5e-4, axis=[0.0, 3.0, 4.0])
    found, error = measure(log, budget=budget), sizes_of(errors, log, random_robot(rng, 1), axis)
    turned = rotation_vectors(attitude_error(log))
    assert AnalysedLog(log, budget).budget.axis == pytest.approx(axis)
    away = []
    for first in range(0, ticks - window + 1, window):
        rows = turned[first : first + window]
        away += [*(rows - rows.mean(axis=0))]
    vectors = np.array(away)
    assert len(vectors) == 1000
    about = vectors @ axis
    jitter = [
        np.linalg.norm(vectors - np.outer(about, axis), axis=1),
        np.abs(about),
        np.linalg.norm(vectors, axis=1),
    ]
    for i, name in enumerate(ANGLES):
        angle = error[name] / ARCSEC
        expected = {
            "rms": np.sqrt(np.mean(angle**2)),
            "max": angle.max(),
            "end": angle[-1],
            "within_band": np.mean(angle <= 0.03 * 3600.0),
            "outside_band": np.mean(angle > 0.03 * 3600.0),
            "jitter_rms": np.sqrt(np.mean(jitter[i] ** 2)) / ARCSEC,
            "jitter_max": jitter[i].max() / ARCSEC,
        }
        assert 0.05 < expected["within_band"] < 0.95
        own = {key: found[f"{name}.{key}"] for key in expected}
        assert own == pytest.approx(expected, rel=1e-12)
    assert "half_cone.jitter_rms" not in measure(log.rows(0, 10))


@pytest.mark.parametrize(("segments", "axis"), MISSIONS)
def test_the_axis_that_points_is_that_of_the_first_pointing_segment(
    segments: list[str], axis: tuple[float, float, float]
) -> None:
    pointed = pointed_axis(segments)
    assert PointingBudget().along(pointed).axis == pytest.approx(axis)
    assert pointed is None or np.linalg.norm(pointed) > 0.0
    start = '{"point": "nadir", "axis": [0, 2, 0]}'
    assert PointingBudget().along(pointed_axis([], start)).axis == [0.0, 1.0, 0.0]
    pointed = pointed_axis(MISSIONS[0][0], start)
    assert PointingBudget().along(pointed).axis == pytest.approx([0.0, 0.6, 0.8])
    assert PointingBudget(axis=[5, 0, 0]).along(pointed).axis == [1.0, 0.0, 0.0]
    with pytest.raises(ValueError, match="axis must have a norm"):
        PointingBudget(axis=[0, 0, 0])


@pytest.mark.parametrize(
    ("mission", "points"),
    [
        ({"segments": ["{base: nadir, duration: 10}"]}, True),
        ({"segments": ["{hold: 10}"], "base_point": '{"point": "sun"}'}, True),
        ({"segments": ["{base: {rpy_deg: [0, 0, 90]}, duration: 9}"], "base_point": ""}, False),
        ({}, False),
    ],
)
def test_a_flight_whose_mission_points_the_base_says_how_well(
    mission: dict[str, Any], points: bool
) -> None:
    log = Scenario(duration=0.05, orbit="iss").fly().log
    log.scenario = None
    log.flight["scenario"]["mission"] |= mission
    report = analyze(log)
    brief = analyze(log, in_brief=True)
    said = [text for text in remarks(brief) if text.startswith("the base points: ")]
    assert report["pointing"]["points"] is points
    rms = report["metrics"]["half_cone.rms"]
    assert len(said) == points
    assert all(f"half cone from the reference {rms:.3g} arcsec RMS" in text for text in said)


TICKS = 5


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
    settings = PlantNodeSettings()
    robots = SimpleNamespace(plant=robot, controller=robot)
    log.scenario = SimpleNamespace(robots=robots, plant=settings)
    path = ToolPath(log)
    np.testing.assert_allclose(path.errors(0, TICKS), 0.0, atol=1e-12)
    shift, angle = rng.normal(size=3), 0.3
    turn = Rotation.from_rotvec([0.0, 0.0, angle])
    log.base_position[1:] += shift  # with the whole robot, and so with the path
    found = path.errors(0, TICKS)
    np.testing.assert_allclose(found[:, :2], 0.0, atol=1e-12)
    assert found[:, 2].max() == pytest.approx(np.linalg.norm(shift))
    attitude = turn * Rotation.from_quat(np.roll(log.quaternion, -1, axis=1))
    log.quaternion[:] = np.roll(attitude.as_quat(), 1, axis=1)
    np.testing.assert_allclose(path.errors(0, TICKS)[:, 1], angle, rtol=1e-9)


def moving(start: list[float], *segments: dict[str, Any], **options: Any) -> sr.Scenario:
    mission = {"start": {"joints_deg": start}, "segments": [*segments]}
    return sr.Scenario(mission=mission, controller="ctc", friction=False, case="1", **options)


def turned(over: float, *segments: dict[str, Any], **options: Any) -> sr.Scenario:
    turn = {"joints_deg": [5, 120, 220, 0, -10, 0], "duration": over}
    return moving([0, 120, 220, 0, -10, 0], turn, *segments, **options)


@pytest.mark.parametrize("frame", ["inertial", "base"])
def test_a_panel_on_one_side_does_not_displace_the_tool(frame: str) -> None:
    """A locked panel moves the base's centre of mass, not the frame that goals are given in."""
    goal = [1.8, 0.2, 0.3]
    panels = yaml.safe_load((CONFIG / "robots/flexible_panels.yaml").read_text())
    links = panels["robot"]["links"]
    panels["robot"]["links"] = [x for x in links if not x["name"].startswith("right")]
    segment = {"tool": {"xyz": goal, "frame": frame}, "duration": 3}
    gains = str(CONFIG / "gains/flexible_panels/tuned/ctc.yaml")
    flown = moving([10, -60, 120], segment, robot=panels, gains=gains, duration=4).fly()
    log = flown.log
    _, place = tool_pose(flown.flight.robot, log.quaternion[-1:], log.all_positions[-1:])
    if frame == "inertial":
        place += log.base_position[-1]
    np.testing.assert_allclose(place[0], goal, atol=2e-5)
    assert flown.metrics["tool.max"] < 2e-5


def test_in_orbit_the_path_is_that_of_the_free_centre_of_mass() -> None:
    """Drag moves the robot from the origin in free fall, and the tool not from its path."""
    thick = {"plant": {"atmosphere.density": 1e-8}}
    flown = turned(5, {"hold": 15}, orbit="iss", parameters=thick).fly()
    assert flown.metrics["path_drift.max"] > 1e-2
    assert flown.metrics["tool.max"] < 1e-5


def test_a_capture_moves_the_path_only_from_then_on() -> None:
    log = turned(1, duration=2, events=["capture@1:tumbling_satellite"]).fly().log
    path = ToolPath(log)
    parts = [path.wanted(*part)[2] for part in [(0, 1200), (1200, 2000), (2000, 4000)]]
    drift = np.concatenate(parts)
    np.testing.assert_allclose(drift[:2001], 0.0, atol=1e-9)
    per_tick = np.diff(drift[2000:], axis=0)
    assert np.linalg.norm(per_tick[0]) > 1e-7
    np.testing.assert_allclose(per_tick, np.broadcast_to(per_tick[0], per_tick.shape), atol=1e-10)


def test_a_line_is_flown_within_a_micrometre_and_a_payload_moves_it() -> None:
    goal = {"xyz": [0.3, 0.0, -0.4], "rpy_deg": [0, 0, 0]}
    scenario = moving([0, 90, 200, 20, 30, 10], {"tool": goal, "duration": 2})
    found = scenario.fly().metrics
    assert found["tool.rms"] <= found["tool.max"] < 1e-6
    assert found["tool_rotation.rms"] <= found["tool_rotation.max"] < np.radians(1e-5)
    loaded = scenario.replace(case={"payload": {"mass": 20.0}}).fly()
    assert loaded.metrics["tool.max"] > 1e-3
    plain = sr.Scenario(duration=0.1).fly().log  # joints alone lead no tool
    plain.scenario = None
    assert not leads_tool(plain)
    for column in (plain.reference_joints[-1, 0], plain.reference_base[-1, :4]):
        before = column.copy()
        column += 0.01  # unless changed in flight
        assert leads_tool(plain)
        column[:] = before
