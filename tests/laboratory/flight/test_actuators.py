"""Flights on wheels, thrusters and torquers: errors, limit cycles, failures, stored momentum."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bags import messages_in
from flights import planned

from space_robot.analysis import tracking_error
from space_robot.flight.plan import Flight
from space_robot.flight.simulate import simulate
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import SingularAttitudeError


def fly(bag: Path | None = None, **options: Any) -> tuple[Flight, FlightLog]:
    """``allocation``: settings of it, by their names in the group."""
    allocation = {f"allocation.{k}": v for k, v in options.pop("allocation", {}).items()}
    parameters = {"controller": allocation, **options.pop("parameters", {})}
    flight = planned(**{"duration": 0.1, "parameters": parameters, **options})
    return flight, simulate(flight, bag)


def attitude_error(log: FlightLog) -> Array:
    return tracking_error(log)[:, :3]


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_wheels_fly_as_well_as_ideal_torque() -> None:
    _, ideal = fly(duration=1.5)
    for wheels in ("pseudo_inverse", "least_largest"):
        _, log = fly(duration=1.5, actuators="wheels", allocation={"wheels": wheels})
        assert rms(attitude_error(log)) < 1.2 * rms(attitude_error(ideal))


def test_wheel_that_fails_is_left_out() -> None:
    flight, log = fly(duration=4.0, actuators="wheels", faults=["wheel_fail@1:3"])
    assert flight.controller.allocation.failed == ("wheel_3",)
    assert np.abs(attitude_error(log)).max() < 2e-5
    assert np.abs(attitude_error(log)[-1000:]).max() < 1e-7
    assert not log.actuator_commands[2400:, 2].any()


@pytest.mark.parametrize(
    ("law", "modulation"), [("tde_stc", "sigma_delta"), ("tde_tsmc", "schmitt"), ("ctc", "schmitt")]
)
def test_thrusters_hold_a_limit_cycle_under_robust_gains(law: str, modulation: str) -> None:
    options = {"actuators": "thrusters", "gains": "robust", "controller": law}
    flight, log = fly(duration=4.0, allocation={"modulation": modulation}, **options)
    assert np.abs(attitude_error(log)[4000:]).max() < 1e-4
    command = log.actuator_commands
    assert set(np.unique(command)) == {0.0, 4.5}
    edges = np.diff(command > 0.0, axis=0)
    for column in edges.T:
        lengths = np.diff(np.flatnonzero(column))[::2]  # from an opening to its closing
        assert lengths.size == 0 or lengths.min() >= 40
    assert flight.controller.allocation.values["pulses"] > 10


def test_thrusters_unload_wheels_in_flight() -> None:
    settings = {"unload_above": 0.45, "unload_to": 0.2, "unload_time": 5.0, "modulation": "pwm"}
    _, log = fly(duration=6.0, actuators="wheels_and_thrusters", allocation=settings)
    stored = np.abs(log.wheel_velocities[[0, -1]].sum(axis=1))
    assert stored[1] < 0.5 * stored[0]
    assert np.abs(attitude_error(log)).max() < 1e-6


# Messages of all parts


OF_TWO = pytest.mark.parametrize(
    "options",
    [{"actuators": "wheels_and_thrusters"}, {"actuators": "wheels_and_torquers", "orbit": "iss"}],
)


@OF_TWO
def test_faults_of_messages_strike_all_parts_of_a_state_alike(
    options: dict[str, str], tmp_path: Path
) -> None:
    faults = ["drop_state@0.01-0.06:0.2", "delay_state@0.06-0.07:3", "repeat_state@0.08-0.09"]
    flight, log = fly(tmp_path / "bag", faults=faults, seed=3, **options)
    assert log.filled > 0
    assert set(log.lost.values()) == {0}
    assert np.isfinite(log.wheel_velocities).all()
    sent = {t: [*messages_in(tmp_path / "bag", t)] for t in topics.STATES}
    stamps = {topic: [data[4:12] for _, data in found] for topic, found in sent.items() if found}
    assert 0 < len(stamps[topics.BASE_STATE]) < 200
    assert all(found == stamps[topics.BASE_STATE] for found in stamps.values())
    names = flight.plant.names
    assert (topics.WHEELS_STATE in stamps) is bool(names.wheels)
    assert (topics.THRUSTERS_STATE in stamps) is bool(names.thrusters)
    assert (topics.MAGNETOMETER in stamps) is bool(names.torquers)


@OF_TWO
def test_late_commands_of_actuators_are_a_plant_that_applies_them_late(
    options: dict[str, str],
) -> None:
    """All numbers of a command come late as one."""
    _, late = fly(faults=["delay_command@0:2"], **options)
    _, slow = fly(command_latency_ticks=2, **options)
    for name in ("quaternion", "wheel_velocities", "thrusts", "actuator_commands"):
        np.testing.assert_array_equal(getattr(late, name), getattr(slow, name), name)


def test_a_state_without_an_answer_has_no_command_to_any_actuator(tmp_path: Path) -> None:
    singular = {"plant": {"initial_quaternion": [0.0, 0.0, 1.0, 0.0]}}
    with pytest.raises(SingularAttitudeError) as caught:
        fly(tmp_path / "bag", actuators="wheels_and_thrusters", parameters=singular)
    log = caught.value.log
    assert log
    assert log.actuator_commands.shape == (1, 16)
    assert np.isnan(log.actuator_commands).all()
    assert read_flight(tmp_path / "bag").wheel_velocities.tolist() == log.wheel_velocities.tolist()


# Wheels that are unloaded by torquers

AXES = np.array([[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]) / np.sqrt(3.0)
SPIN = 0.0318
"""Of the wheels in config/actuators/wheels_and_torquers.yaml: axes, and inertia, kg m2."""


def stored(log: FlightLog) -> Array:
    """Return the momentum (N, 3) of the wheels on base axes, N m s."""
    return np.asarray(SPIN * log.wheel_velocities @ AXES)


def test_torquers_unload_the_wheels_and_the_law_notices_nothing() -> None:
    """Wheels hold against the torquers to rounding. What remains of the errors is the wheels'
    gyroscopic torque, which a law feels: it is that of the momentum that they have left."""
    over_the_pole = {"orbital_elements.inclination_deg": 80.0, "orbital_elements.anomaly_deg": 50.0}
    logs = [
        fly(
            controller="ctc",
            actuators="wheels_and_torquers",
            orbit="iss",
            period=0.005,
            duration=160.0,
            allocation={"dump": dump, "magnetic_gain": 0.005},
            parameters={"plant": {"wheels.initial_speed": [31.4], **over_the_pole}},
        )[1]
        for dump in ("magnetic", "none")
    ]
    unloaded, loaded = (np.linalg.norm(stored(log)[-1]) for log in logs)
    assert unloaded < 0.9 * loaded
    assert not logs[1].actuator_commands[:, 4:].any()
    one, other = map(tracking_error, logs)
    largest = np.abs(other).max()
    assert largest > 1e-6
    assert np.abs(one - other).max() < 1e-3 * largest
    assert rms(one - other) < 1e-4 * rms(other)
