"""Wheels, thrusters and torquers: one flight in a bag, compiled, and message by message."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import SingularAttitudeError
from space_robot_msgs_py.samples import ACTUATOR_FIELDS, ORBIT_FIELDS, STATE_FIELDS

NOTHING = "drop_state@0:0"
"""A fault of messages that never happens."""
COLUMNS = (
    *(*STATE_FIELDS, *ACTUATOR_FIELDS, *ORBIT_FIELDS),
    *("commanded_torque", "actuator_commands"),
)
KINDS = ("wheels", "thrusters", "wheels_and_thrusters", "wheels_and_torquers", "none")
LAWS = ("tde_stc", "ctc")


def plan(actuators: str, law: str = "tde_stc", **options: object) -> FlightPlan:
    orbit = "iss" if actuators == "wheels_and_torquers" else "none"
    given = {"controller": law, "actuators": actuators, "orbit": orbit, "duration": 0.1}
    return FlightPlan.model_validate({**given, **options})


def assert_same(one: FlightLog, other: FlightLog) -> None:
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("actuators", KINDS)
def test_its_bag_and_its_messages_are_the_flight(actuators: str, law: str, tmp_path: Path) -> None:
    """To the last bit; a fault that never happens makes every message pass one by one."""
    flight = Flight(resolve(plan(actuators, law)))
    names = flight.plant.names
    log = simulate(flight, tmp_path / "bag")
    back = read_flight(tmp_path / "bag")
    assert_same(back, log)
    assert (back.damage, back.unanswered, set(back.lost.values())) == ((), 0, {0})
    assert_same(simulate(Flight(resolve(plan(actuators, law, faults=[NOTHING])))), log)
    sent = {name for name, _ in open_bag(tmp_path / "bag").messages(*topics.STATES)}
    assert (topics.WHEELS_STATE.full_name in sent) is bool(names.wheels)
    assert (topics.THRUSTERS_STATE.full_name in sent) is bool(names.thrusters)
    assert (topics.MAGNETOMETER.full_name in sent) is bool(names.torquers)
    assert log.wheel_velocities.shape == (200, len(names.wheels))
    assert log.actuator_commands.shape == (200, len(names.actuators))
    assert np.isfinite(log.actuator_commands).all()
    assert log.wheel_torques.any() == bool(names.wheels)


@pytest.mark.parametrize("actuators", ["wheels", "wheels_and_thrusters", "wheels_and_torquers"])
def test_faults_of_messages_strike_all_parts_of_a_state_alike(
    actuators: str, tmp_path: Path
) -> None:
    faults = ["drop_state@0.01-0.06:0.2", "delay_state@0.06-0.07:3", "repeat_state@0.08-0.09"]
    log = simulate(Flight(resolve(plan(actuators, faults=faults, seed=3))), tmp_path / "bag")
    assert log.filled > 0
    assert set(log.lost.values()) == {0}
    assert np.isfinite(log.wheel_velocities).all()
    stamps = {
        topic: [data[4:12] for _, data in open_bag(tmp_path / "bag").messages(topic)]
        for topic in topics.STATES
    }
    assert stamps[topics.WHEELS_STATE] == stamps[topics.BASE_STATE] == stamps[topics.JOINT_STATES]
    if actuators == "wheels_and_torquers":
        assert stamps[topics.MAGNETOMETER] == stamps[topics.BASE_STATE]
    assert 0 < len(stamps[topics.BASE_STATE]) < 200


def test_thrusters_that_fire_are_in_the_bag(tmp_path: Path) -> None:
    log = simulate(Flight(resolve(plan("thrusters", "ctc", duration=0.2))), tmp_path / "bag")
    assert log.actuator_commands.any()
    assert log.thrusts.any()
    assert_same(read_flight(tmp_path / "bag"), log)


@pytest.mark.parametrize("actuators", ["wheels_and_thrusters", "wheels_and_torquers"])
def test_late_commands_of_actuators_are_a_plant_that_applies_them_late(actuators: str) -> None:
    """All numbers of a command come late as one."""
    late = simulate(Flight(resolve(plan(actuators, faults=["delay_command@0:2"]))))
    slow = simulate(Flight(resolve(plan(actuators, command_latency_ticks=2))))
    assert_same(late, slow)


def test_a_state_without_an_answer_has_no_command_to_any_actuator(tmp_path: Path) -> None:
    singular = {"plant": {"initial_quaternion": [0.0, 0.0, 1.0, 0.0]}}
    with pytest.raises(SingularAttitudeError) as caught:
        simulate(
            Flight(resolve(plan("wheels_and_thrusters", parameters=singular))), tmp_path / "bag"
        )
    log = caught.value.log
    assert log
    assert log.actuator_commands.shape == (1, 16)
    assert np.isnan(log.actuator_commands).all()
    assert read_flight(tmp_path / "bag").wheel_velocities.tolist() == log.wheel_velocities.tolist()
