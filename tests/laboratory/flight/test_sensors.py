"""Flights with sensors that are not ideal, with and without the navigation filter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from attitude_sensors import attitude_error
from flights import planned
from numpy.typing import NDArray

from space_robot.flight.closed_loop import close_loop
from space_robot.flight.flown_log import empty_log
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Command

Array = NDArray[np.float64]

LOOK_TICKS = 100


def flown(**plan: Any) -> tuple[Array, Array]:
    """True errors of attitude and joints now and then, (K, 9); commands (ticks, 9)."""
    flight = planned(**plan)
    log, errors = empty_log(flight), []
    for start in range(0, log.ticks - LOOK_TICKS, LOOK_TICKS):
        stop, truth = start + LOOK_TICKS, flight.plant.truth
        close_loop(flight.plant, flight.controller, log, start, stop)
        attitude = attitude_error(truth.quaternion, log.reference_base[stop, :4])
        joints = log.reference_joints[stop, 0] - truth.joint_positions
        errors.append(np.r_[0.5 * attitude, joints])  # as eps
    return np.array(errors), log.commanded_torque[:-LOOK_TICKS]


SIGMA = {"white_l1": (1e-5, 1e-6), "tactical": (2.6e-6, 1.3e-4), "coarse": (2.1e-5, 1.97e-3)}
"""Standard deviations that the files say, of joint angles, rad, and of rates, rad/s."""


@pytest.mark.parametrize("sensors", SIGMA)
def test_the_truth_under_the_same_torque_does_not_know_of_sensors(sensors: str) -> None:
    ideal = planned().plant
    other = planned(sensors=sensors).plant
    rng = np.random.default_rng(1)
    angles, turns = [], []
    for tick in range(600):
        command = Command(tick, rng.normal(size=9))
        for plant in (ideal, other):
            plant.step(command)
        np.testing.assert_array_equal(ideal.truth.numbers, other.truth.numbers)
        angles.append(other.state.joint_positions - other.truth.joint_positions)
        turns.append(other.state.omega_base - other.truth.omega_base)
    assert (np.std(angles), np.std(turns)) == pytest.approx(SIGMA[sensors], rel=0.1)


def test_a_flight_s_seed_counts() -> None:
    """At every tick behind the first, whose state is measured before anything is commanded."""
    plan = FlightPlan(sensors="fine", faults=["noise_gyro@0.01:1e-6"], duration=0.05)
    one, other = (
        simulate(Flight(resolve(plan.model_copy(update={"seed": seed})))) for seed in (3, 4)
    )
    assert (one.commanded_torque[1:] != other.commanded_torque[1:]).any(axis=1).all()
    assert (one.quaternion != one.as_measured().quaternion).any()


@pytest.mark.parametrize("law", laws())
def test_every_law_flies_with_fine_sensors(law: str) -> None:
    """The true errors stay below those of the star tracker itself, 4e-5 rad about its boresight."""
    plan = {"controller": law, "sensors": "fine", "navigation": "filtered", "duration": 1.5}
    if law.startswith(("ctc", "tde")):  # CTC, with 100 rad/s the loudest: 14 to 21 N m
        limits = (4e-5, 5e-5, 30.0 if law == "ctc" else 15.0)
    else:  # gains for these sensors; ADRC, which observes angles, is the loudest: 16 N m
        limits, plan["gains"] = (2e-4, 2e-3, 25.0), "robust"
    errors, torque = flown(**plan)
    found = (
        np.abs(errors[5:, :3]).max(),
        np.abs(errors[5:, 3:]).max(),
        np.abs(torque[2000:]).max(),
    )
    assert np.less(found, limits).all(), found


@pytest.mark.parametrize(("sensors", "most"), [("tactical", 1e-4), ("coarse", 5e-3)])
def test_the_default_law_flies_with_any_sensors(sensors: str, most: float) -> None:
    errors, _ = flown(sensors=sensors, navigation="filtered", duration=1.0)
    assert np.abs(errors).max() < most


def test_the_filter_takes_noise_out_of_the_torque() -> None:
    torques = [
        flown(navigation=mode, sensors="fine", duration=1.5)[1][2000:, :3]
        for mode in ("direct", "filtered")
    ]
    direct, filtered = (np.sqrt(np.mean(np.diff(torque, axis=0) ** 2)) for torque in torques)
    assert filtered < 0.1 * direct


def test_a_delay_that_is_known_costs_nothing_and_one_that_is_not_does() -> None:
    """On a base that begins 0.3 rad off and turns back."""
    errors = []
    for given in ({}, {"navigation_filter.tracker_delay": 0.0}):
        parameters = {"plant": {"initial_quaternion": [0.99, 0.14, 0.0, 0.0]}, "controller": given}
        plan = FlightPlan(
            sensors="fine", navigation="filtered", duration=1.5, parameters=parameters
        )
        flight = Flight(resolve(plan))
        log = empty_log(flight)
        close_loop(flight.plant, flight.controller, log, 0, 2000)
        truth = flight.plant.truth.copy()
        assert np.abs(truth.omega_base).max() > 0.005
        close_loop(flight.plant, flight.controller, log, 2000, 2001)
        estimate = flight.controller.block[0].navigation.estimate
        errors.append(np.abs(attitude_error(estimate.quaternion, truth.quaternion)).max())
    assert errors[0] < 5e-5
    assert errors[1] > 10.0 * errors[0]


def described(**plan: Any) -> dict[str, Any]:
    return planned(duration=0.1, **plan).description


def test_a_flight_tells_its_sensors_and_what_its_filter_assumes() -> None:
    """The filter is for the flight's sensors unless told otherwise."""
    assert described(sensors="tactical")["parameters"]["plant"]["sensors"] == "tactical"
    assert "navigation_filter" not in described()
    for sensors, controller, across in (
        ("tactical", {}, 4e-5),
        ("tactical", {"navigation_sensors": "coarse"}, 1e-4),
        ("tactical", {"navigation_filter.tracker_across": 1e-3}, 1e-3),
    ):
        parameters = {"controller": controller}
        told = described(sensors=sensors, navigation="filtered", parameters=parameters)
        assert told["sensors"] == sensors
        assert told["navigation_filter"]["tracker_across"] == across
    with pytest.raises(InputError, match="unknown sensor 'good': choose one of coarse, fine"):
        described(parameters={"controller": {"navigation_sensors": "good"}}, navigation="filtered")
    with pytest.raises(InputError, match="unknown sensor 'best': choose one of coarse, fine"):
        described(sensors="best")


@pytest.mark.parametrize("fault", ["stop_controller@1", "kill_mission@1"])
def test_what_fails_between_nodes_needs_them(fault: str) -> None:
    flight = planned(faults=["noise_gyro@0:1e-6", fault], duration=0.01)
    with pytest.raises(InputError) as caught:
        simulate(flight)
    assert str(caught.value) == f"faults ['{fault}']: that needs the graph of nodes: use `fly`"
