"""Whole flights with real sensors and the navigation filter: they fly, and repeat to the bit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attitude_sensors import attitude_error
from flights import Flown, space_robot_here
from numpy.typing import NDArray

from space_robot import load_bag
from space_robot.flight.closed_loop import close_loop
from space_robot.flight.flown_log import empty_log
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

LOOK_TICKS = 100


def flown(**plan: Any) -> tuple[Flight, Array, Array]:
    """A flight; true errors of attitude and joints now and then, (K, 9); commands (ticks, 9)."""
    flight = Flight(resolve(FlightPlan(**plan)))
    log, errors = empty_log(flight), []
    assert log.reference_base is not None
    assert log.reference_joints is not None
    for start in range(0, log.ticks - LOOK_TICKS, LOOK_TICKS):
        stop, truth = start + LOOK_TICKS, flight.plant.truth
        close_loop(flight.plant, flight.controller, log, start, stop)
        attitude = attitude_error(truth.quaternion, log.reference_base[stop, :4])
        joints = log.reference_joints[stop, 0] - truth.joint_positions
        errors.append(np.r_[0.5 * attitude, joints])  # as eps
    assert log.commanded_torque is not None
    return flight, np.array(errors), log.commanded_torque[:-LOOK_TICKS]


def roughness(torque: Array) -> float:
    """RMS of the steps from tick to tick on the base, N m."""
    return float(np.sqrt(np.mean(np.diff(torque[2000:, :3], axis=0) ** 2)))


@pytest.mark.parametrize("law", laws())
def test_every_law_flies_with_fine_sensors(law: str) -> None:
    """The true errors stay below those of the star tracker itself, 4e-5 rad about its boresight."""
    plan = {"controller": law, "sensors": "fine", "navigation": "filtered", "duration": 3.0}
    if not law.startswith(("ctc", "tde")):  # gains for these sensors; friction costs them joints
        _, errors, torque = flown(gains="robust", **plan)
        assert np.abs(errors[5:, :3]).max() < 2e-4
        assert np.abs(errors[5:, 3:]).max() < 2e-3
        # ADRC, which observes angles, is the loudest: 16 N m
        assert np.abs(torque[2000:]).max() < 25.0
        return
    _, errors, torque = flown(**plan)
    assert np.abs(errors[5:, :3]).max() < 4e-5
    assert np.abs(errors[5:, 3:]).max() < 5e-5
    # CTC, with 100 rad/s the loudest: 14 to 21 N m with seeds 0 to 5
    assert np.abs(torque[2000:]).max() < (30.0 if law == "ctc" else 15.0)


@pytest.mark.parametrize("sensors", ["tactical", "coarse"])
def test_the_default_law_flies_with_any_sensors(sensors: str) -> None:
    _, errors, _ = flown(sensors=sensors, navigation="filtered", duration=2.0)
    assert np.abs(errors).max() < (1e-4 if sensors == "tactical" else 5e-3)


def test_the_filter_takes_noise_out_of_the_torque() -> None:
    plan = {"sensors": "fine", "duration": 2.0}
    direct, filtered = (
        roughness(flown(navigation=mode, **plan)[2]) for mode in ("direct", "filtered")
    )
    assert filtered < 0.1 * direct


def test_a_delay_that_is_known_costs_nothing_and_one_that_is_not_does() -> None:
    """On a base that begins 0.3 rad off and turns back."""
    errors = []
    for given in ({}, {"navigation_filter.tracker_delay": 0.0}):
        parameters = {"plant": {"initial_quaternion": [0.99, 0.14, 0.0, 0.0]}, "controller": given}
        flight = Flight(
            resolve(
                FlightPlan(
                    sensors="fine", navigation="filtered", duration=1.5, parameters=parameters
                )
            )
        )
        log = empty_log(flight)
        close_loop(flight.plant, flight.controller, log, 0, 2000)
        truth = flight.plant.truth.copy()
        assert np.abs(truth.omega_base).max() > 0.005
        close_loop(flight.plant, flight.controller, log, 2000, 2001)
        estimate = flight.controller.block[0].navigation.estimate
        errors.append(np.abs(attitude_error(estimate.quaternion, truth.quaternion)).max())
    assert errors[0] < 5e-5
    assert errors[1] > 10.0 * errors[0]


def test_the_filter_is_for_the_flights_sensors_unless_told_otherwise() -> None:
    def assumed(**plan: Any) -> dict[str, Any]:
        found = Flight(resolve(FlightPlan(navigation="filtered", duration=0.1, **plan))).description
        numbers: dict[str, Any] = found["navigation_filter"]
        return numbers

    assert assumed(sensors="tactical")["tracker_across"] == 4e-5
    other = {"controller": {"navigation_sensors": "coarse"}}
    assert assumed(sensors="tactical", parameters=other)["tracker_across"] == 1e-4
    single = {"controller": {"navigation_filter.tracker_across": 1e-3}}
    assert assumed(sensors="tactical", parameters=single)["tracker_across"] == 1e-3
    with pytest.raises(InputError, match="unknown sensor 'good'"):
        assumed(parameters={"controller": {"navigation_sensors": "good"}})
    assert "navigation_filter" not in Flight(resolve(FlightPlan(duration=0.1))).description


def test_graph_process_and_replay_have_the_same_bits(
    fly: Callable[..., Flown], tmp_path: Path
) -> None:
    """Under a law and another, with sensors that are not ideal."""
    options = (
        "--sensors",
        "fine",
        "--navigation",
        "filtered",
        "--duration",
        "0.8",
        "--swap",
        "0.4:tde_smc",
        "--seed",
        "3",
    )
    graph = fly(*options, "--composed")
    plan = FlightPlan(
        sensors="fine", navigation="filtered", duration=0.8, swaps=["0.4:tde_smc"], seed=3
    )
    alone = simulate(Flight(resolve(plan)))
    np.testing.assert_array_equal(load_bag(graph.bag).commanded_torque, alone.commanded_torque)
    result = space_robot_here("replay", str(graph.bag))
    assert result.returncode == 0, result.stdout + result.stderr
    assert "to the last bit" in result.stdout
