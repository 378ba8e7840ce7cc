"""Flights of arms with passive, prismatic and geared joints: logs, reports and momentum."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import planned, simulated
from oracles.momenta import momentum
from robots import PASSIVE_ROBOT, geared_paper_arm
from strategies import with_gears

import space_robot as sr
from space_robot.analysis import analyze, measure
from space_robot.analysis.described import flown_robot
from space_robot.analysis.export import column_names
from space_robot.analysis.figures.single_flight import control_results
from space_robot.analysis.measure import describe
from space_robot.analysis.momentum import whole_momentum
from space_robot.analysis.report_tables import rms_table
from space_robot.analysis.words import with_statistic
from space_robot.flight.batch import batches
from space_robot.flight.simulate import simulate
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import motor_momentum
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.parts import Encoder
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

# Passive and prismatic joints


@pytest.fixture(scope="module")
def bent(tmp_path_factory: pytest.TempPathFactory) -> FlightLog:
    """With sensors and a filter, so that truth and measurement differ; its bag was read back."""
    bag = tmp_path_factory.mktemp("passive") / "bag"
    options = {"sensors": "fine", "navigation": "filtered", "duration": 1.2}
    log = simulated(bag, robot=PASSIVE_ROBOT, controller="tde_stc", **options)
    recorded = read_flight(bag)
    assert recorded.passive_names == ("panel_root", "panel_tip", "slosh")
    assert recorded.prismatic == log.prismatic == (*[False, True], *[False] * 6, True)
    assert flown_robot(recorded).nominal.joint_names == log.joint_names
    assert json.loads(json.dumps(analyze(recorded))) == json.loads(json.dumps(analyze(log)))
    return log


@pytest.mark.parametrize("law", ["tde_stc", "pd"])
def test_laws_hold_attitude_and_moves_the_joints_with_motors(law: str) -> None:
    """The springs are felt, not commanded; the model that the law has knows them locked."""
    flight = planned(robot=PASSIVE_ROBOT, controller=law, duration=1.2, friction=False)
    flown = simulate(flight)
    assert flight.controller.block[0].signals.model.joint_count == 6
    assert flight.plant.memory.model.joint_count == 9
    report = analyze(flown)
    found = report["metrics"]
    slack = 10.0 if law == "pd" else 1.0  # which knows no springs and observes nothing
    assert found["attitude.max"] < slack * 1e-6
    assert max(found["joints_revolute.max"], found["joints_prismatic.max"]) < slack * 1e-4
    assert (np.ptp(flown.joint_positions, axis=0) > 0.01).all()
    assert (np.ptp(flown.passive_positions, axis=0) > 1e-5).all()
    if law == "tde_stc":
        for kind, unit in (("prismatic", "N"), ("revolute", "N m")):
            assert f"estimate_error_{kind}.rms" in found
            assert describe(f"estimate_error_{kind}.rms").unit == unit
    linear, _ = momentum(flight.plant.robot, flight.plant.truth)
    assert np.abs(linear).max() < 1e-10, "torques push nothing away"


def test_errors_and_forces_are_told_by_kind(bent: FlightLog) -> None:
    """No number is of rad and of m, and each has its unit."""
    report = analyze(bent)
    kinds = ("revolute", "prismatic")
    columns = {"attitude", "base_torque", "torque_revolute", "force_prismatic"}
    found = with_statistic(report["metrics"], "rms_eq64")
    assert found.keys() == columns | {"attitude_angle"} | {f"joints_{kind}" for kind in kinds}
    found = with_statistic(report["metrics"], "rms")
    table = [row[1] for group in rms_table(report).groups for row in group.rows]
    assert table == ["deg", "rad", "m", "N m", "N m", "N"]
    error = bent.reference_joints[:, 0] - bent.joint_positions
    rms = np.sqrt(np.mean(error**2, axis=0))
    assert found["joints_prismatic"] == pytest.approx(rms[1])
    assert found["joints_revolute"] == pytest.approx(np.delete(rms, 1).mean())
    assert describe("force_prismatic.variation").unit == "N/s"
    assert describe("navigation_joints_prismatic.rms").unit == "m"
    assert {"force_prismatic.variation", "navigation_joints_prismatic.rms"} <= {*report["metrics"]}
    names = {"boom_velocity_m_s", "panel_tip_position_rad", "slosh_velocity_m_s", "error_boom_m"}
    names |= {"applied_torque_boom_n", "applied_torque_wrist_n_m", "assumed_error_boom_m"}
    assert names <= set(column_names(bent))
    labels = [axes.get_ylabel() for axes in control_results(bent, "").axes]
    assert {"joint error (rad; boom: m)", "joint torque (N m; boom: N)"} <= set(labels)


def test_momentum_and_tool_are_those_of_the_whole_robot(bent: FlightLog) -> None:
    """As the inertia matrix has the momentum; a panel that bends moves what the base carries."""
    robot, tick = flown_robot(bent), bent.ticks - 1
    row = slice(tick, tick + 1)
    motion = Motion(
        bent.quaternion[row],
        bent.omega_base[row],
        bent.all_positions[row],
        bent.all_velocities[row],
    )
    found = robot_momentum(robot, motion)
    linear, about_origin = momentum(robot, bent.state(tick))
    centre = bent.base_position[tick] + found.centre_of_mass[0]
    angular = about_origin - np.cross(centre, linear)
    np.testing.assert_allclose(found.angular[0], angular, rtol=0.0, atol=1e-10)
    error = measure(bent, ["boresight.max", "tool_position.max"])
    assert np.isfinite(error["boresight.max"])
    assert error["tool_position.max"] < 1e-2


# Gears


@pytest.fixture(scope="module")
def robot(paper_robot: Robot) -> Robot:
    """All kinds of encoders, and two rigid joints."""
    gears = geared_paper_arm(paper_robot).gears
    sides: tuple[Encoder | None, ...] = ("motor", None, "link", "both", None, "motor")
    chosen = [
        gear._replace(encoder=side) if gear and side else None
        for gear, side in zip(gears, sides, strict=True)
    ]
    return with_gears(paper_robot, chosen)


def scenario(robot: Robot, **options: Any) -> sr.Scenario:
    """Return a flight under computed torque."""
    return sr.Scenario(**{"robot": robot, "controller": "ctc", "duration": 0.3, **options})


def test_a_log_has_motors_and_what_is_measured_of_them(robot: Robot, tmp_path: Path) -> None:
    """In the order of their joints; the encoders' noise of the fine sensors is some 1e-6 rad."""
    log = simulate(scenario(robot, sensors="fine").check(), tmp_path / "bag")
    assert log.geared_names == ("joint1", "joint3", "joint4", "joint6")
    assert log.motor_positions.shape == log.motor_velocities.shape == (log.ticks, 4)
    joints = [robot.joint_names.index(name) for name in log.geared_names]
    deflection = log.motor_positions - log.joint_positions[:, joints]
    assert (deflection[0] == 0.0).all()
    assert (np.abs(deflection).max(axis=0) > 1e-7).all()
    # the mean rate over a tick is the difference of two angles
    middle = 0.5 * (log.motor_velocities[1:] + log.motor_velocities[:-1])
    rates = np.diff(log.motor_positions, axis=0) / log.timebase.period
    np.testing.assert_allclose(rates, middle, rtol=0.0, atol=1e-3 * np.abs(middle).max())
    assert log.measured is not None
    error = log.measured.joint_positions - log.joint_positions
    motors = log.measured.joint_positions[:, [0, 5]] - log.motor_positions[:, [0, 3]]
    noise = error[:, 1:5].std(axis=0).max()
    assert motors.std(axis=0).max() < 1.5 * noise
    assert np.abs(motors.mean(axis=0)).max() < noise
    recorded = read_flight(tmp_path / "bag", trust=True)
    assert not recorded.damage
    assert flown_robot(recorded).gears == robot.gears
    assert analyze(recorded) == analyze(log)


@pytest.mark.parametrize(
    "options",
    [{"actuators": "none", "sensors": "fine", "friction": False}, {"actuators": "wheels"}],
)
def test_the_analysis_counts_the_motors_and_finds_momentum_conserved(
    robot: Robot, options: dict[str, Any]
) -> None:
    """On a base that nothing pushes from outside, to 1e-12 of what base and motors exchange.

    With steps of 125 us: the integrator's error falls with their fourth power,
    and is 5e-11 with those of 500 us.
    """
    log = simulate(scenario(robot, substeps=4, **options).check())
    momentum = whole_momentum(log)
    expected = motor_momentum(robot, log.quaternion, log.joint_positions, log.motor_velocities)
    np.testing.assert_array_equal(momentum.motors, expected)
    exchanged = np.linalg.norm(momentum.base, axis=1).max()
    assert np.linalg.norm(momentum.motors, axis=1).max() > 1e-3 * exchanged
    assert np.abs(momentum.total).max() < 1e-12 * exchanged
    without = momentum.robot + momentum.wheels
    assert np.abs(without).max() > 1e-3 * exchanged, "the motors' part must not be left out"
    assert analyze(log)["metrics"]["momentum_drift.max"] < 1e-12 * exchanged


def test_arms_with_other_gears_fly_apart_and_with_other_numbers_together(
    robot: Robot, paper_robot: Robot
) -> None:
    """A rigid joint is another robot in the lanes' eyes; so is an encoder on the other side."""
    gears = robot.gears
    other_side = [gear and gear._replace(encoder="link") for gear in gears]
    stiffer = [gear and gear._replace(stiffness=3.0 * gear.stiffness) for gear in gears]
    rigid = [*gears[:5], None]
    robots = [paper_robot, robot, with_gears(robot, rigid), with_gears(robot, other_side)]
    robots += [*robots[:1], with_gears(robot, stiffer), *robots[2:]]
    flights = [scenario(one).check() for one in robots]
    groups = [[number for number, _ in group] for group in batches(enumerate(flights))]
    assert sorted(groups) == [[0, 4], [1, 5], [2, 6], [3, 7]]
