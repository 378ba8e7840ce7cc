"""Flights with sensors that are not ideal, and with parts that fail, in one process."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Command, Reference

Array = NDArray[np.float64]

FAULTS = [
    "noise_gyro@0.02-0.1:1e-6",
    "quantise_joint_velocity@0.1:1e-6",
    "gyro_bias@0.05:base_x=1e-6",
    "tracker_blind@0.12-0.13",
    "encoder_stuck@0.15-0.16:3",
    "saturate_joints@0.05-0.06:5",
    "stuck_joint@0.1-0.2:2=1",
    "torque_scale@0.1:base=1.001",
]
PLAN: dict[str, Any] = {"sensors": "fine", "faults": FAULTS, "duration": 0.3, "seed": 3}
COLUMNS = (
    "quaternion",
    "angular_velocity",
    "joint_positions",
    "joint_velocities",
    "applied_torque",
    "commanded_torque",
)


def flown(**options: Any) -> FlightLog:
    return simulate(Flight(resolve(FlightPlan(**{**PLAN, **options}))))


def numbers(log: FlightLog) -> Array:
    return np.hstack([getattr(log, name) for name in COLUMNS])


def test_a_flight_repeats_to_the_bit_and_its_seed_counts() -> None:
    first = numbers(flown())
    np.testing.assert_array_equal(numbers(flown()), first)
    assert (numbers(flown(seed=4))[1:] != first[1:]).any(axis=1).all()


def test_another_process_flies_the_same_bits() -> None:
    """Its hashes of names are salted another way."""
    code = (
        "import hashlib, test_sensors as t\n"
        "print(hashlib.sha256(t.numbers(t.flown()).tobytes()).hexdigest())"
    )
    found = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parent,
    )
    assert found.stdout.strip() == hashlib.sha256(numbers(flown()).tobytes()).hexdigest()


def test_compiled_stretches_fly_as_single_ticks_do() -> None:
    """Part faults begin and end, and random numbers run out, within the flight."""
    flight, log = Flight(resolve(FlightPlan(**PLAN))), flown()
    assert log.commanded_torque is not None
    told = log.as_measured()
    plant, chunk = flight.plant, flight.mission.chunk(0, flight.ticks)
    reference = Reference.at_rest(flight.robot.n)
    joints, base = Reference.parts(reference)
    for tick in range(flight.ticks):
        joints[0], base[0] = chunk.joints[tick], chunk.base[tick]
        for state, rows in ((plant.state, told), (plant.truth, log)):
            np.testing.assert_array_equal(state.quaternion, rows.quaternion[tick])
            np.testing.assert_array_equal(state.joint_velocities, rows.joint_velocities[tick])
        command = flight.controller.update(plant.state, reference)
        np.testing.assert_array_equal(command.torque, log.commanded_torque[tick])
        plant.step(command)


@pytest.mark.parametrize("sensors", ["white_l1", "tactical", "coarse"])
def test_the_truth_under_the_same_torque_does_not_know_of_sensors(sensors: str) -> None:
    """Errors are the sensors' own: of the order that their file says."""
    ideal = Flight(resolve(FlightPlan())).plant
    other = Flight(resolve(FlightPlan(sensors=sensors))).plant
    rng = np.random.default_rng(1)
    angles, turns = [], []
    for tick in range(600):
        command = Command(tick, rng.normal(size=9))
        for plant in (ideal, other):
            plant.step(command)
        np.testing.assert_array_equal(ideal.truth.numbers, other.truth.numbers)
        angles.append(other.state.joint_positions - other.truth.joint_positions)
        turns.append(other.state.omega_base - other.truth.omega_base)
    sigma = {"white_l1": (1e-5, 1e-6), "tactical": (2.6e-6, 1.3e-4), "coarse": (2.1e-5, 1.97e-3)}
    assert np.std(angles) == pytest.approx(sigma[sensors][0], rel=0.1)
    assert np.std(turns) == pytest.approx(sigma[sensors][1], rel=0.1)


def test_a_flight_tells_its_sensors() -> None:
    flight = Flight(resolve(FlightPlan(sensors="tactical")))
    assert flight.description["sensors"] == "tactical"
    assert flight.description["parameters"]["plant"]["sensors"] == "tactical"
    again = Flight(resolve(FlightPlan.model_validate(flight.scenario.tree)))
    assert again.scenario.tree == flight.scenario.tree
    with pytest.raises(InputError, match="unknown sensor 'best': choose one of coarse, fine"):
        Flight(resolve(FlightPlan(sensors="best")))


@pytest.mark.parametrize("fault", ["stop_controller@1", "kill_mission@1"])
def test_what_fails_between_nodes_needs_them(fault: str) -> None:
    flight = Flight(resolve(FlightPlan(faults=["noise_gyro@0:1e-6", fault], duration=0.01)))
    with pytest.raises(InputError) as caught:
        simulate(flight)
    assert str(caught.value) == f"faults ['{fault}']: that needs the graph of nodes: use `fly`"
