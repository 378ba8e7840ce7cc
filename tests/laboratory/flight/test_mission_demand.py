"""What missions ask of the base's actuators, and what a start away from the mission's asks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from flights import planned
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import pinocchio_model
from scipy.spatial.transform import Rotation

import space_robot as sr
from space_robot.cli.options import remarks_on
from space_robot.flight.mission_demand import (
    MOST_SAMPLES,
    demand_remark,
    excess,
    held_base_remark,
    mission_demand,
)
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import simulate
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import SOURCES
from space_robot_sim.environment.orbit import OrbitSettings

POSTURE = [0, 90, 200, 20, 30, 10]
LINE = {"tool": {"xyz": [0.3, 0.0, -0.4]}}
SLOW_TURN = {"base": {"rpy_deg": [0, 0, 30]}, "duration": 60}


def flight(segment: dict[str, Any], actuators: str, **limits: bool) -> Flight:
    mission = {
        "start": {"joints_deg": POSTURE},
        "segments": [segment],
        **({"limits": limits} if limits else {}),
    }
    return planned(actuators=actuators, mission=mission, controller="ctc")


def test_torque_and_momentum_are_named_with_axis_time_and_amounts() -> None:
    with pytest.raises(InputError) as told:
        flight({**LINE, "duration": 3}, "wheels")
    assert "the mission's part 1 (tool) asks for " in str(told.value)
    assert " N m about base_y at t = 2." in str(told.value)
    assert "\n" not in str(told.value)
    half_turn = {"base": {"rpy_deg": [0, 0, 179]}, "duration": 58}
    with pytest.raises(InputError, match=r"asks for .* N m s about base_z at t = 29\.00 s"):
        flight(half_turn, "wheels")


@pytest.mark.parametrize(
    ("segment", "actuators", "limits"),
    [
        ({**LINE, "duration": 3}, "ideal", {}),
        ({**LINE, "duration": 3}, "none", {}),
        ({**LINE, "duration": 30}, "wheels", {}),
        (SLOW_TURN, "thrusters", {}),
        ({**SLOW_TURN, "duration": 30}, "small_wheels", {"check_actuators": False}),
    ],
)
def test_what_they_can_give_is_flown(
    segment: dict[str, Any], actuators: str, limits: dict[str, bool]
) -> None:
    assert flight(segment, actuators, **limits).mission.duration == segment["duration"]


TURN = {"base": {"rpy_deg": [10, 40, -20]}, "duration": 60}
WORLD = {
    "orbital_elements": {"height": 400e3, "inclination_deg": 51.6, "anomaly_deg": 30.0},
    "atmosphere": {"density": 3e-12, "at_height": 400e3},
    "sunlight": {"pressure": 4.56e-6, "beta_angle_deg": 30.0},
    "magnetism": {"strength": 2.98e-5, "residual_dipole": [10.0, -20.0, 30.0]},
}


def test_the_momentum_is_that_which_a_flight_gives_its_base(paper_robot: Robot) -> None:
    """And the torque, under the exact model, with an orbit's torques, in motion and at rest."""
    mission = {
        "start": {"joints_deg": POSTURE},
        "segments": [{**TURN, "joints_deg": [30, 60, 170, 40, 20, 40]}, {"hold": 90}],
    }
    plan = Scenario(controller="ctc", mission=mission, orbit=WORLD, period=0.005, friction=False)
    flight = Flight(resolve(plan))
    log = simulate(flight)
    demands = list(mission_demand(paper_robot, flight.mission.pieces, flight.plant_settings))
    turned = Rotation.from_quat(log.quaternion[:-1, [1, 2, 3, 0]])
    flown = 0.005 * np.cumsum(turned.apply(log.applied_torque[1:, :3]), axis=0)
    (_, moved, _), (_, held, sources) = demands
    time = np.concatenate([moved.time, held.time[1:]])
    momentum = np.concatenate([moved.momentum, held.momentum[1:]])
    planned = np.column_stack([np.interp(log.time[1:], time, axis) for axis in momentum.T])
    largest, end = (np.linalg.norm(x) for x in (np.abs(momentum).max(axis=0), momentum[-1]))
    assert largest > 10.0
    assert end > 0.1
    np.testing.assert_allclose(flown, planned, rtol=0.0, atol=1e-4 * largest)
    np.testing.assert_allclose(flown[-1], planned[-1], rtol=0.0, atol=2e-3 * end)
    for asked in (moved, held):
        time = asked.time[5:-5]
        axes = log.applied_torque[1:, :3].T
        applied = np.column_stack([np.interp(time, log.time[:-1] + 0.0025, axis) for axis in axes])
        scale = np.abs(applied).max()
        np.testing.assert_allclose(asked.torque[5:-5, :3], applied, rtol=0.0, atol=1e-2 * scale)
    impulses = 0.005 * np.sum(log.external_torques, axis=0).reshape(-1, 3)
    for name, impulse in zip(SOURCES, impulses, strict=True):
        assert sources[name].momentum_end == pytest.approx(np.linalg.norm(impulse), rel=1e-3)
        assert sources[name].base_torque > 0.0


def test_wheels_keep_their_first_momentum_on_inertial_axes(paper_robot: Robot) -> None:
    """A base that turns by 90 degrees about x finds what z held in its y wheel."""
    wheels = {
        "axes": np.eye(3).ravel().tolist(),
        "max_torque": [10.0],
        "max_momentum": [1e3, 20.0, 1e3],
        "rotor_inertia": [0.1],
        "initial_speed": [0.0, 0.0, 100.0],
    }
    turn = {"base": {"rpy_deg": [90, 0, 0]}, "duration": 600}
    flown = flight(turn, "ideal")
    pieces, orbit = flown.mission.pieces, OrbitSettings()
    demands = list(mission_demand(paper_robot, pieces, orbit))
    hardware = BaseActuatorSettings(base_actuation="hardware", wheels=wheels)
    largest = excess(hardware, demands).momentum
    (_, asked, _) = demands[0]
    turned = Rotation.from_quat(asked.base[:, :4], scalar_first=True).inv()
    held = turned.apply([0.0, 0.0, 10.0] - asked.momentum)
    assert largest == pytest.approx(np.abs(held[:, 1]).max() / 20.0, rel=1e-9)
    assert largest >= 0.5


def test_samples_of_long_missions_are_bounded(paper_robot: Robot) -> None:
    turn = {"base": {"turn_deg": 90.0, "axis": [0, 0, 1]}, "duration": 1e4}
    mission = {"start": {"joints_deg": POSTURE}, "segments": [turn] * 40}
    demands = mission_demand(paper_robot, planned(mission=mission).mission.pieces, OrbitSettings())
    assert sum(len(asked.time) for _, asked, _ in demands) <= MOST_SAMPLES


@pytest.mark.parametrize(
    ("segment", "part"),
    [
        ({**LINE, "duration": 20}, "part 1 (tool)"),
        (TURN, "part 1 (base)"),
        ({**LINE, "duration": 20, "base": "free"}, ""),
        ({"tool": {"xyz": [1.0, 0.3, 0.2], "frame": "base"}, "duration": 60}, ""),
        ({"joints_deg": [0, 80, 190, 20, 30, 10], "duration": 20}, ""),
    ],
)
def test_a_free_base_under_a_mission_that_holds_it_is_remarked(
    segment: dict[str, Any], part: str
) -> None:
    flown = flight(segment, "none")
    assert held_base_remark(flight(segment, "ideal").scenario) == ""
    remark = held_base_remark(flown.scenario)
    assert bool(remark) == bool(part)
    if part:
        assert f"the mission's {part} is planned with a base whose attitude is contr" in remark
        assert "base: free" in remark
        assert "\n" not in remark
        assert f"warning: {remark}" in remarks_on(flown)
        with pytest.warns(UserWarning, match="base: free"):
            sr.Scenario(**{**flown.scenario.tree, "duration": 0.01}).fly()


def test_missions_that_are_not_refused_are_warned_of_if_they_are_flown() -> None:
    remarks = [
        demand_remark(resolve(Scenario(actuators=actuators, duration=duration)))
        for actuators, duration in (("small_wheels", None), ("small_wheels", 0.1), ("wheels", None))
    ]
    assert "the mission's part 1 (joints) asks for " in remarks[0]
    assert "% of what the actuators give" in remarks[0]
    assert remarks[1:] == ["", ""]


def test_a_rate_that_the_law_brakes_fills_the_wheels() -> None:
    """What the robot's bodies have at the start, the wheels have once the base is at rest."""
    start = {"joints_deg": POSTURE, "base": {"rate_deg_s": [3.0, 2.0, 1.0]}}
    mission = {"start": start, "segments": [{"hold": 5.0}]}
    with pytest.raises(InputError, match=r"asks for .* N m s about base_. at t = 0\.00 s, .* hold"):
        planned(mission=mission, actuators="wheels")
    flight = planned(mission=mission)
    rate = np.radians([3.0, 2.0, 1.0])
    model = pinocchio_model(flight.robot)
    data, still = model.createData(), np.zeros(model.nv)
    joints = np.radians(POSTURE)[list(flight.robot.order)]
    pin.ccrba(model, data, np.concatenate([np.zeros(6), [1.0], joints]), still)
    ((_, asked, _),) = mission_demand(flight.robot, flight.mission.pieces, OrbitSettings(), rate)
    wanted = np.tile(-data.Ig.inertia @ rate, (len(asked.time), 1))
    np.testing.assert_allclose(asked.momentum, wanted, rtol=1e-9)


def test_what_is_pointed_at_after_the_missions_end_is_checked_to_the_flights_end() -> None:
    """About a fixed axis nadir cannot be pointed at all around a polar orbit."""
    base = {"point": "nadir", "about": [0.0, 0.0, 1.0]}
    start = {"joints_deg": POSTURE, "base": base}
    polar = {"plant": {"orbital_elements.inclination_deg": 90.0}}
    options = {"mission": {"start": start, "segments": [{"hold": 5.0}]}, "orbit": "iss"}
    planned(**options, parameters=polar)
    with pytest.raises(
        InputError, match=r"^after the mission's end: base\.about: .* line of nadir"
    ):
        planned(**options, parameters=polar, duration=2000.0)


# A start away from the mission's

JOINTS = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]


def started(quaternion: Any = None, joints: Any = None, **options: Any) -> sr.Scenario:
    plant = {} if quaternion is None else {"initial_quaternion": list(quaternion)}
    plant |= {} if joints is None else {"initial_joints_deg": list(joints)}
    given = {"controller": "ctc", "duration": 0.2, "parameters": {"plant": plant}}
    return sr.Scenario(**{**given, **options})


@settings(max_examples=3, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3), st.integers(0, 5))
def test_a_start_elsewhere_is_told_with_its_distance(vector: list[float], joint: int) -> None:
    """The angle is SciPy's; the sign of q does not count."""
    turn = Rotation.from_rotvec(vector)
    joints = [*JOINTS[:joint], JOINTS[joint] + 5.0, *JOINTS[joint + 1 :]]
    with pytest.warns(UserWarning, match="^start: "):
        flight = started(-turn.as_quat(scalar_first=True), joints, duration=0.01).fly()
    step = flight.report()["start_step"]
    angle = np.degrees(turn.magnitude())
    assert step["attitude_deg"] == pytest.approx(angle if angle > 1.0 else 0.0, abs=1e-4)
    assert (step["joint"], step["unit"]) == (f"joint{joint + 1}", "rad")
    assert step["joint_error"] == pytest.approx(np.radians(5.0))


@pytest.mark.parametrize(
    "options",
    [
        {"quaternion": [-2.0, 0.0, 0.0, 0.0]},
        {"quaternion": [0.9, 0.1, 0.0, 0.0], "actuators": "none"},
        {"joints": [*JOINTS[:5], 1e-5], "controller": "tde_stc"},
        {"quaternion": [0.9, 0.1, 0.0, 0.0], "controller": None},
    ],
)
def test_where_there_is_no_step_nothing_is_said(options: Any) -> None:
    """Also of a base that nothing turns, and of a flight that no law flies."""
    flight = started(**options).check()
    assert flight.start_step is None
    assert "start_step" not in flight.description
