"""Flights of arms with gears: their logs, bags, momentum, and eight of them at once."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geared_robots import geared_paper_arm, with_gears
from numpy.typing import NDArray

import space_robot as sr
from space_robot.analysis import analyze
from space_robot.analysis.described import momentum_of, robot_of
from space_robot.flight.batch.sharing import batches
from space_robot.flight.simulate import simulate
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import motor_momentum
from space_robot_model.robot.tree import Encoder
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

Array = NDArray[np.float64]

MOTORS = ("motor_positions", "motor_velocities")


@pytest.fixture(scope="module")
def robot(paper_robot: Robot) -> Robot:
    """All kinds of encoders, and two rigid joints."""
    gears = geared_paper_arm(paper_robot).gears
    sides: tuple[Encoder | None, ...] = ("motor", None, "link", "both", None, "motor")
    return with_gears(
        paper_robot,
        [
            gear._replace(encoder=side) if gear and side else None
            for gear, side in zip(gears, sides, strict=True)
        ],
    )


def scenario(robot: Robot, **options: Any) -> sr.Scenario:
    """Return a flight under computed torque."""
    return sr.Scenario(**{"robot": robot, "controller": "ctc", "duration": 0.3, **options})


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("geared") / "bag"


@pytest.fixture(scope="module")
def log(robot: Robot, bag: Path) -> FlightLog:
    """With sensors, so that truth and measurement differ."""
    return simulate(scenario(robot, sensors="fine").check(), bag)


def test_a_log_has_motors_in_the_order_of_their_joints(robot: Robot, log: FlightLog) -> None:
    assert log.geared_names == ("joint1", "joint3", "joint4", "joint6")
    assert log.motor_positions.shape == log.motor_velocities.shape == (log.ticks, 4)
    for name in MOTORS:
        assert np.isfinite(getattr(log, name)).all()
    joints = [robot.joint_names.index(name) for name in log.geared_names]
    deflection = log.motor_positions - log.joint_positions[:, joints]
    assert (deflection[0] == 0.0).all()
    assert (np.abs(deflection).max(axis=0) > 1e-7).all()
    # the mean rate over a tick is the difference of two angles
    middle = 0.5 * (log.motor_velocities[1:] + log.motor_velocities[:-1])
    rates = np.diff(log.motor_positions, axis=0) / log.timebase.period
    np.testing.assert_allclose(rates, middle, rtol=0.0, atol=1e-3 * np.abs(middle).max())


def test_what_is_measured_is_near_motor_or_link(robot: Robot, log: FlightLog) -> None:
    """The encoders' noise of the fine sensors is some 1e-6 rad."""
    assert log.measured is not None
    error = log.measured.joint_positions - log.joint_positions
    motors = log.measured.joint_positions[:, [0, 5]] - log.motor_positions[:, [0, 3]]
    noise = error[:, 1:5].std(axis=0).max()
    assert motors.std(axis=0).max() < 1.5 * noise
    assert np.abs(motors.mean(axis=0)).max() < noise


def test_a_bag_tells_the_flight_to_the_bit(robot: Robot, log: FlightLog, bag: Path) -> None:
    recorded = read_flight(bag, trust=True)
    assert not recorded.damage
    assert recorded.geared_names == log.geared_names
    for name in (*MOTORS, "joint_positions", "joint_velocities", "applied_torque", "quaternion"):
        np.testing.assert_array_equal(getattr(recorded, name), getattr(log, name), name)
    assert recorded.measured is not None
    assert log.measured is not None
    np.testing.assert_array_equal(recorded.measured.joint_positions, log.measured.joint_positions)
    assert robot_of(recorded).gears == robot.gears
    assert analyze(recorded) == analyze(log)


def test_a_resolved_scenario_flies_the_same_bits(robot: Robot, log: FlightLog) -> None:
    resolved = copy.deepcopy(scenario(robot, sensors="fine").resolved())
    again = sr.Scenario(**resolved).fly().log
    for name in (*MOTORS, "joint_positions", "applied_torque"):
        np.testing.assert_array_equal(getattr(again, name), getattr(log, name), name)


@pytest.mark.parametrize(
    "options",
    [
        {"actuators": "none"},
        {"actuators": "none", "sensors": "fine", "friction": False},
        {"actuators": "wheels"},
    ],
)
def test_the_analysis_counts_the_motors_and_finds_momentum_conserved(
    robot: Robot, options: dict[str, Any]
) -> None:
    """On a base that nothing pushes from outside, to 1e-12 of what base and motors exchange.

    With steps of 125 us: the integrator's error falls with their fourth power,
    and is 5e-11 with those of 500 us.
    """
    log = simulate(scenario(robot, substeps=4, **options).check())
    momentum = momentum_of(log).add(log)
    expected = motor_momentum(robot, log.quaternion, log.joint_positions, log.motor_velocities)
    np.testing.assert_array_equal(momentum.motors, expected)
    exchanged = np.linalg.norm(momentum.base, axis=1).max()
    assert np.linalg.norm(momentum.motors, axis=1).max() > 1e-3 * exchanged
    assert np.abs(momentum.total).max() < 1e-12 * exchanged
    without = momentum.robot + momentum.wheels
    assert np.abs(without).max() > 1e-3 * exchanged, "the motors' part must not be left out"
    assert analyze(log)["momentum"]["drift"]["n_m_s"] < 1e-12 * exchanged


def stiffer(robot: Robot, factor: float) -> Robot:
    return with_gears(
        robot, [gear and gear._replace(stiffness=gear.stiffness * factor) for gear in robot.gears]
    )


def test_eight_at_once_fly_the_bits_of_each_alone(robot: Robot) -> None:
    """With other gears, seeds, faults and friction in each lane; motors that stop and stand."""
    changes: list[dict[str, Any]] = [
        {},
        {"seed": 3},
        {"robot": stiffer(robot, 3.0)},
        {"robot": stiffer(robot, 0.5), "seed": 1},
        {"faults": ["stuck_joint@0.1-0.2:1=500"]},
        {"faults": ["encoder_stuck@0.05-0.1:6"]},
        {"parameters": {"plant": {"friction.coulomb": 1.0}}},
        {"case": "3"},
    ]
    scenarios = [
        scenario(**{"robot": robot, "sensors": "fine", "duration": 0.25, **change})
        for change in changes
    ]
    groups = [[number for number, _ in g] for g in batches(enumerate(s.check() for s in scenarios))]
    assert groups == [list(range(8))]
    together = sr.fly_many(scenarios)
    for number, (flight, one) in enumerate(zip(together, scenarios, strict=True)):
        alone = one.fly()
        assert flight.outcome == alone.outcome
        for name, column in alone.log.columns.items():
            np.testing.assert_array_equal(flight.log.columns[name], column, f"{number} {name}")
    stood = [(flight.log.motor_velocities == 0.0).any(axis=0) for flight in together]
    assert stood[4][0]
    assert len({flight.log.motor_positions[-1].tobytes() for flight in together}) == 8


def test_arms_with_other_gears_fly_apart(robot: Robot, paper_robot: Robot) -> None:
    """A rigid joint is another robot in the lanes' eyes; so is an encoder on the other side."""
    gears = robot.gears
    other_side = [gear and gear._replace(encoder="link") for gear in gears]
    robots = [
        paper_robot,
        robot,
        with_gears(robot, [*gears[:5], None]),
        with_gears(robot, other_side),
    ]
    scenarios = [scenario(r, duration=0.05, seed=k) for k in range(2) for r in robots]
    flights = [one.check() for one in scenarios]
    groups = [[number for number, _ in group] for group in batches(enumerate(flights))]
    assert sorted(groups) == [[0, 4], [1, 5], [2, 6], [3, 7]]
    for flight, one in zip(sr.fly_many(scenarios), scenarios, strict=True):
        np.testing.assert_array_equal(flight.log.motor_positions, one.fly().log.motor_positions)
