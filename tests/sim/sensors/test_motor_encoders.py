"""Encoders of joints with gears: on the motor's side, on the link's, or both."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from geared_robots import PERIOD, GearedFlight, rotor_room, with_gears
from numpy.typing import NDArray
from random_robots import random_robot

from space_robot_model.robot import Robot
from space_robot_model.robot.tree import Encoder, Gear
from space_robot_msgs_py.samples import RobotState

Array = NDArray[np.float64]

N, SUBSTEPS = 6, 2
SIDES: tuple[Encoder | None, ...] = ("link", "motor", None, "both", "motor", None)
"""Of each joint's encoder; None: the joint has no gear."""
AT_MOTORS = {1: 2, 4: 4}
"""Number of the motor that is measured, by joint."""
TORQUE = np.array([3.0, -2.0, 1.0, 20.0, -15.0, 10.0, 12.0, -8.0, 5.0])


def geared(sides: tuple[Encoder | None, ...] = SIDES) -> Robot:
    robot = random_robot(np.random.default_rng(8), N)
    gears = [
        Gear(0.02 * rotor_room(robot, joint), 10.0, 400.0, 0.5, side or "link")
        for joint, side in enumerate(sides)
    ]
    has_gear = [bool(side) for side in SIDES]
    return with_gears(
        robot, [gear if has else None for gear, has in zip(gears, has_gear, strict=True)]
    )


def flown(robot: Robot, ticks: int, **settings: Any) -> tuple[GearedFlight, list[RobotState]]:
    """Return a flight in open loop, and what its sensors reported at every tick."""
    flight = GearedFlight(robot, SUBSTEPS, **settings)
    measured = [flight.plant.state.copy()]
    for _ in range(ticks):
        flight.fly(TORQUE)
        measured.append(flight.plant.state.copy())
    return flight, measured


def test_ideal_encoders_tell_motor_or_link_to_the_bit() -> None:
    flight = GearedFlight(geared(), SUBSTEPS, initial_joints_deg=[10.0 * k for k in range(N)])
    for tick in range(50):
        if tick:
            flight.fly(TORQUE)
        state, truth = flight.plant.state, flight.plant.truth
        positions, velocities = truth.joint_positions.copy(), truth.joint_velocities.copy()
        for joint, motor in AT_MOTORS.items():
            positions[joint] = truth.motor_positions[motor - 1]
            velocities[joint] = truth.motor_velocities[motor - 1]
        np.testing.assert_array_equal(state.joint_positions, positions)
        np.testing.assert_array_equal(state.joint_velocities, velocities)
        for name in ("motor_positions", "motor_velocities", "omega_base", "applied_torque"):
            np.testing.assert_array_equal(getattr(state, name), getattr(truth, name), name)
    deflection = np.abs(positions - truth.joint_positions)
    assert deflection[[1, 4]].min() > 1e-5
    assert not deflection[[0, 2, 3, 5]].any()


@pytest.mark.parametrize("side", ["motor", "link", "both"])
def test_only_with_encoders_at_motors_the_measured_state_is_not_the_true_one(side: Encoder) -> None:
    flight = GearedFlight(geared((side,) * N), SUBSTEPS)
    assert flight.plant.measures_truth == (side != "motor")
    state, truth = flight.plant.state, flight.plant.truth
    np.testing.assert_array_equal(state.numbers, truth.numbers)  # at rest nothing is stretched


def test_noise_is_added_to_what_the_encoder_is_on() -> None:
    """Of the size that is set, and the same numbers whichever side it is on."""
    sides: tuple[Encoder, ...] = ("motor", "link")
    sensors = {"encoders": {"noise": 1e-4, "velocity_noise": 2e-3}, "fault_seed": 5}
    flights, reported = zip(
        *(flown(geared((side,) * N), 600, **sensors) for side in sides), strict=True
    )
    truths = flown(geared(), 600)
    at_motor, at_link = (
        np.array([state.joint_positions for state in states]) for states in reported
    )
    np.testing.assert_array_equal(flights[0].x, flights[1].x)
    np.testing.assert_array_equal(flights[0].x, truths[0].x)
    links = np.array([state.joint_positions for state in truths[1]])
    motors = links.copy()
    motors[:, flights[0].joints] = [state.motor_positions[:4] for state in truths[1]]
    links[:, list(AT_MOTORS)] = np.nan  # the ideal ones are at the motors
    errors = at_motor - motors
    assert errors.std(axis=0) == pytest.approx(1e-4, rel=0.15)
    same = [joint for joint in range(N) if joint not in AT_MOTORS]
    np.testing.assert_allclose((at_link - links)[:, same], errors[:, same], rtol=0.0, atol=1e-15)


def test_steps_and_differences_are_those_of_the_motors_angle() -> None:
    bits, lag = 14, 10
    step = 2.0 * np.pi / 2**bits
    robot = geared(("motor",) * N)
    encoders = {"bits": bits, "difference_ticks": lag}
    flight, measured = flown(robot, 100, encoders=encoders)
    _, ideal = flown(robot, 100)
    motors = np.array([state.motor_positions[:4] for state in ideal])
    joints = flight.joints
    reported = np.array([state.joint_positions[joints] for state in measured])
    np.testing.assert_allclose(reported, step * np.floor(motors / step + 0.5), rtol=0.0, atol=1e-12)
    rates = np.array([state.joint_velocities[joints] for state in measured])
    expected = (reported[lag:] - reported[:-lag]) / (lag * PERIOD)
    np.testing.assert_allclose(rates[lag:], expected, rtol=0.0, atol=1e-9)
    assert np.abs(expected).max() > 0.0


def test_a_stuck_encoder_is_stuck_whatever_it_is_on() -> None:
    faults = ["encoder_stuck@0.02:joint2"]
    flight, measured = flown(geared(), 100, faults=faults)
    reported = np.array([state.joint_positions[1] for state in measured])
    motors = flight.plant.truth.motor_positions[1]
    assert len(set(reported[40:])) == 1
    assert abs(reported[-1] - motors) > 1e-5
    assert not any(state.joint_velocities[1] for state in measured[40:])
