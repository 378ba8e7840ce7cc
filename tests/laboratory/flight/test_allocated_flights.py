"""Flights on wheels and thrusters that share a torque out: errors, limit cycles, failures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]


def fly(**options: Any) -> tuple[Flight, FlightLog]:
    allocation = {f"allocation.{k}": v for k, v in options.pop("allocation", {}).items()}
    parameters = {"controller": allocation}
    flight = Flight(resolve(FlightPlan(**{"duration": 6.0, "parameters": parameters, **options})))
    return flight, simulate(flight)


def attitude_error(log: FlightLog) -> Array:
    """(N, 3), eps."""
    desired = log.references(log.first_tick, log.first_tick + log.ticks)["quaternion"]
    side = np.sign(np.sum(log.quaternion * desired, axis=1))[:, None]
    return np.asarray(side * desired[:, 1:] - log.quaternion[:, 1:])


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("wheels", ["pseudo_inverse", "least_largest"])
def test_wheels_fly_as_well_as_ideal_torque(wheels: str) -> None:
    _, ideal = fly()
    _, log = fly(actuators="wheels", allocation={"wheels": wheels})
    assert rms(attitude_error(log)) < 1.2 * rms(attitude_error(ideal))


def test_wheel_that_fails_is_left_out() -> None:
    flight, log = fly(actuators="wheels", faults=["wheel_fail@2:3"])
    assert flight.controller.allocation.failed == ("wheel_3",)
    assert np.abs(attitude_error(log)).max() < 2e-5
    assert np.abs(attitude_error(log)[-2000:]).max() < 1e-7
    assert log.actuator_commands is not None
    assert not log.actuator_commands[4400:, 2].any()


def test_wheels_stay_away_from_zero() -> None:
    settings = {"least_speed": 30.0, "null_gain": 5.0}
    _, log = fly(actuators="wheels", allocation=settings)
    assert np.abs(log.wheel_velocities[4000:]).min() > 20.0
    assert rms(attitude_error(log)) < 2e-8


@pytest.mark.parametrize("law", ["tde_stc", "tde_smc", "tde_tsmc", "ctc", "ctc_smc"])
@pytest.mark.parametrize("modulation", ["schmitt", "sigma_delta"])
def test_thrusters_hold_a_limit_cycle_under_robust_gains(law: str, modulation: str) -> None:
    flight, log = fly(
        actuators="thrusters", gains="robust", controller=law, allocation={"modulation": modulation}
    )
    assert np.abs(attitude_error(log)[4000:]).max() < 1e-4
    command = log.actuator_commands
    assert command is not None
    assert set(np.unique(command)) == {0.0, 4.5}
    edges = np.diff(command > 0.0, axis=0)
    for column in edges.T:
        lengths = np.diff(np.flatnonzero(column))[::2]  # from an opening to its closing
        assert lengths.size == 0 or lengths.min() >= 40
    assert flight.controller.allocation.values["pulses"] > 10


def test_thrusters_unload_wheels_in_flight() -> None:
    settings = {"unload_above": 0.45, "unload_to": 0.2, "unload_time": 5.0, "modulation": "pwm"}
    _, log = fly(actuators="wheels_and_thrusters", allocation=settings)
    stored = np.abs(log.wheel_velocities[[0, -1]].sum(axis=1))
    assert stored[1] < 0.5 * stored[0]
    assert np.abs(attitude_error(log)).max() < 1e-6
