"""A robot with passive joints and a prismatic one, flown by all laws and told with its units."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conservation import momentum
from passive_robot import PASSIVE_ROBOT

from space_robot.analysis import analyze
from space_robot.analysis.columns import column_names
from space_robot.analysis.described import robot_of
from space_robot.analysis.figures.single_flight import control_results, desired_joints
from space_robot.analysis.pointing import pointing_error
from space_robot.analysis.report_lines import lines
from space_robot.analysis.report_tables import rms_table
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

SHORT = 1.2
"""s; the arm has begun to move, and the panel to bend."""


def plan_of(law: str, **options: object) -> FlightPlan:
    return FlightPlan.model_validate(
        {"robot": PASSIVE_ROBOT, "controller": law, "duration": SHORT, "friction": False, **options}
    )


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("passive") / "bag"


@pytest.fixture(scope="module")
def log(bag: Path) -> FlightLog:
    """With sensors and a filter, so that truth and measurement differ."""
    plan = plan_of("tde_stc", sensors="fine", navigation="filtered", friction=True)
    return simulate(Flight(resolve(plan)), bag)


@pytest.mark.parametrize("law", sorted(laws()))
def test_every_law_holds_attitude_and_moves_the_joints_with_motors(law: str) -> None:
    """The springs are felt, not commanded; the model that the law has knows them locked."""
    flight = Flight(resolve(plan_of(law)))
    flown = simulate(flight)
    assert flight.controller.block[0].signals.model.joint_count == 6
    assert flight.plant.memory.model.joint_count == 9
    report = analyze(flown)
    found = report["maxima"]
    slack = 10.0 if law.startswith("pd") else 1.0  # which knows no springs and observes nothing
    assert found["attitude"] < slack * 1e-6
    assert found["joints_revolute"] < slack * 1e-4
    assert found["joints_prismatic"] < slack * 1e-4
    assert (np.ptp(flown.joint_positions, axis=0) > 0.01).all()
    assert (np.ptp(flown.passive_positions, axis=0) > 1e-5).all()
    estimates = {x.name: x.unit for x in lines([report]) if x.group == "estimate error"}
    assert bool(estimates) == law.startswith("tde")
    if estimates:
        assert estimates["joints_prismatic RMS"] == "N"
        assert estimates["joints_revolute max"] == "N m"
    linear, _ = momentum(flight.plant.robot, flight.plant.truth)
    assert np.abs(linear).max() < 1e-10, "torques push nothing away"


def test_a_bag_tells_the_flight_to_the_bit(log: FlightLog, bag: Path) -> None:
    recorded = read_flight(bag)
    assert recorded.passive_names == ("panel_root", "panel_tip", "slosh")
    assert recorded.prismatic == log.prismatic == (*[False, True], *[False] * 6, True)
    for name in ("joint_positions", "passive_positions", "passive_velocities", "applied_torque"):
        np.testing.assert_array_equal(getattr(recorded, name), getattr(log, name), name)
    assert log.measured
    np.testing.assert_array_equal(log.measured.passive_positions, log.passive_positions)
    assert robot_of(recorded).nominal.joint_names == log.joint_names
    assert json.loads(json.dumps(analyze(recorded))) == json.loads(json.dumps(analyze(log)))


def test_errors_and_forces_are_told_by_kind(log: FlightLog) -> None:
    """No number is of rad and of m, and each has its unit."""
    report = analyze(log)
    columns = [
        "attitude",
        "joints_revolute",
        "joints_prismatic",
        "base_torque",
        "torque_revolute",
        "force_prismatic",
    ]
    assert list(report["rms"]["mean_axis"]) == columns
    units = [row[:2] for group in rms_table(report).groups for row in group.rows]
    assert [unit for _, unit in units] == ["deg", "rad", "m", "N m", "N m", "N"]
    error = log.reference_joints[:, 0] - log.joint_positions
    rms = np.sqrt(np.mean(error**2, axis=0))
    assert report["rms"]["mean_axis"]["joints_prismatic"] == pytest.approx(rms[1])
    assert report["rms"]["mean_axis"]["joints_revolute"] == pytest.approx(np.delete(rms, 1).mean())
    told = {(line.group, line.name): line for line in lines([report])}
    assert told["maximum", "force_prismatic"].unit == "N"
    assert told["variation per s", "force_prismatic"].unit == "N/s"
    assert told["navigation error", "joints_prismatic"].unit == "m"
    assert told["ripple", "force_prismatic"].unit == "N"
    assert told["ripple's peak", "force_prismatic"].texts[0].endswith((" N", "-"))


def test_columns_of_an_export_have_their_units(log: FlightLog) -> None:
    names = column_names(log)
    for name in (
        "boom_position_m",
        "boom_velocity_m_s",
        "wrist_position_rad",
        "panel_tip_position_rad",
        "slosh_velocity_m_s",
        "applied_torque_boom_n",
        "applied_torque_wrist_n_m",
        "applied_torque_base_x_n_m",
        "commanded_torque_boom_n",
        "reported_torque_boom_n",
        "measured_position_boom_m",
        "measured_velocity_shoulder_rad_s",
        "error_boom_m",
        "reference_boom_acceleration_m_s2",
        "reference_wrist_position_rad",
        "assumed_error_boom_m",
    ):
        assert name in names, name
    assert len(set(names)) == len(names)


def test_figures_have_a_panel_a_kind(log: FlightLog) -> None:
    labels = [axes.get_ylabel() for axes in desired_joints(log).axes]
    assert labels == ["desired joint angle (deg)", "desired joint position (m)"]
    labels = [axes.get_ylabel() for axes in control_results(log, "").axes]
    assert "joint error (rad; boom: m)" in labels
    assert "joint torque (N m; boom: N)" in labels


def test_momentum_and_tool_are_those_of_the_whole_robot(log: FlightLog) -> None:
    """As the inertia matrix has the momentum; a panel that bends moves what the base carries."""
    robot, tick = robot_of(log), log.ticks - 1
    row = slice(tick, tick + 1)
    motion = Motion(
        log.quaternion[row], log.omega_base[row], log.all_positions[row], log.all_velocities[row]
    )
    found = robot_momentum(robot, motion)
    linear, about_origin = momentum(robot, log.state(tick))
    centre = log.base_position[tick] + found.centre_of_mass[0]
    angular = about_origin - np.cross(centre, linear)
    np.testing.assert_allclose(found.angular[0], angular, rtol=0.0, atol=1e-10)
    error = pointing_error(log, robot)
    assert np.isfinite(error.boresight).all()
    assert error.position.max() < 1e-2
