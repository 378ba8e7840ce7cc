"""Flights with sensors that are not ideal, and with a disturbance of the user's own."""

from __future__ import annotations

import csv
import json
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from attitude_sensors import attitude_error
from command import Run
from flights import planned, simulated

import space_robot as sr
from space_robot.flight.flown_log import empty_log
from space_robot.flight.simulate import close_loop
from space_robot.scenario.recorded import options_in_bag
from space_robot_control.laws import laws
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Command

# Sensors

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


def test_the_truth_under_the_same_torque_does_not_know_of_sensors() -> None:
    plants = [planned(sensors=sensors).plant for sensors in ("ideal", "coarse")]
    rng = np.random.default_rng(1)
    for tick in range(100):
        command = Command(tick, rng.normal(size=9))
        for plant in plants:
            plant.step(command)
        np.testing.assert_array_equal(plants[0].truth.numbers, plants[1].truth.numbers)


def test_a_flight_s_seed_counts() -> None:
    """At every tick behind the first, whose state is measured before anything is commanded."""
    options = {"sensors": "fine", "faults": ["noise_gyro@0.01:1e-6"], "duration": 0.05}
    one, other = (simulated(**options, seed=seed) for seed in (3, 4))
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
    errors, _ = flown(sensors=sensors, navigation="filtered", duration=0.5)
    assert np.abs(errors).max() < most


def test_the_filter_takes_noise_out_of_the_torque() -> None:
    torques = [
        flown(navigation=mode, sensors="fine", duration=0.7)[1][1000:, :3]
        for mode in ("direct", "filtered")
    ]
    direct, filtered = (np.sqrt(np.mean(np.diff(torque, axis=0) ** 2)) for torque in torques)
    assert filtered < 0.1 * direct


def test_a_delay_that_is_known_costs_nothing_and_one_that_is_not_does() -> None:
    """On a base that begins 0.3 rad off and turns back."""
    errors = []
    for given in ({}, {"navigation_filter.tracker_delay": 0.0}):
        parameters = {"plant": {"initial_quaternion": [0.99, 0.14, 0.0, 0.0]}, "controller": given}
        flight = planned(sensors="fine", navigation="filtered", duration=1.5, parameters=parameters)
        log = empty_log(flight)
        close_loop(flight.plant, flight.controller, log, 0, 2000)
        truth = flight.plant.truth.copy()
        assert np.abs(truth.omega_base).max() > 0.005
        close_loop(flight.plant, flight.controller, log, 2000, 2001)
        estimate = flight.controller.block[0].navigation.estimate
        errors.append(np.abs(attitude_error(estimate.quaternion, truth.quaternion)).max())
    assert errors[0] < 5e-5
    assert errors[1] > 10.0 * errors[0]


def test_a_flight_tells_its_sensors_and_what_its_filter_assumes() -> None:
    """The filter is for the flight's sensors unless told otherwise."""

    def described(**plan: Any) -> dict[str, Any]:
        return planned(duration=0.1, **plan).description

    assert described()["navigation"] == "direct"
    for sensors, controller, across in (
        ("tactical", {}, 4e-5),
        ("tactical", {"navigation_sensors": "coarse"}, 1e-4),
        ("tactical", {"navigation_filter.tracker_across": 1e-3}, 1e-3),
    ):
        parameters = {"controller": controller}
        told = described(sensors=sensors, navigation="filtered", parameters=parameters)
        assert (told["sensors"], told["navigation"]) == (sensors, "filtered")
        assumed = told["scenario"]["parameters"]["controller"]["navigation_filter"]
        assert assumed["tracker_across"] == across
    with pytest.raises(InputError, match="unknown sensor 'good': choose one of coarse, fine"):
        described(parameters={"controller": {"navigation_sensors": "good"}}, navigation="filtered")


# A disturbance

DURATION = 0.1
SAID = "base_force_y, base_torque_z, joint2 from 0 to 0.1 s"


def wind(t: float) -> dict[str, float]:
    return {
        "base_force_y": 3.0 * math.sin(20.0 * t),
        "base_torque_z": 0.4 * math.cos(9.0 * t),
        "joint2": 0.3 * t,
    }


COLUMNS = sr.sampled(wind, DURATION)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The columns as a table."""
    path = tmp_path / "wind.csv"
    with path.open("w", newline="") as table:
        csv.writer(table).writerows([[*COLUMNS], *zip(*COLUMNS.values(), strict=True)])
    return path


def test_file_function_and_numbers_are_one_disturbance(
    file: Path, tmp_path: Path, space_robot: Run
) -> None:
    """Also in a bag, without the file that it was read from; and the command tells it."""
    given = [file, wind, {k: np.array(v) for k, v in COLUMNS.items()}]
    expected = sr.Scenario(disturbance=COLUMNS, duration=DURATION).resolved()
    for disturbance in given:
        scenario = sr.Scenario(disturbance=disturbance, duration=DURATION)
        assert scenario.resolved() == expected
    sent = pickle.loads(pickle.dumps(sr.Scenario(disturbance=wind, duration=DURATION).check()))
    assert sent.scenario.tree == expected
    options = ("--disturbance", file, "--duration", DURATION)
    assert SAID in space_robot("simulate", *options, "--bag", tmp_path / "bag").out
    assert json.loads(space_robot("simulate", *options, "--json").out)["disturbance"] == SAID
    file.unlink()
    assert options_in_bag(tmp_path / "bag")["disturbance"] == COLUMNS
    log = sr.load_bag(tmp_path / "bag")
    assert log.flight["disturbance"] == SAID
    undisturbed = sr.Scenario(duration=DURATION)
    assert "disturbance" not in undisturbed.resolved()
    assert np.abs(undisturbed.fly().log.applied_torque - log.applied_torque).max() > 0.1


def test_a_case_may_name_a_table_beside_it(file: Path, tmp_path: Path) -> None:
    case = {"/**/plant_node": {"ros__parameters": {"disturbance": {"table": file.name}}}}
    (tmp_path / "windy.yaml").write_text(yaml.safe_dump(case))
    scenario = sr.Scenario(case=tmp_path / "windy.yaml", duration=DURATION)
    assert scenario.resolved()["disturbance"] == COLUMNS
    other = {"time": [0.0, 1.0], "joint1": [1.0, 1.0]}
    assert scenario.replace(disturbance=other).resolved()["disturbance"] == other


@pytest.mark.parametrize(
    ("disturbance", "said"),
    [
        (lambda t: None, "the function returned None at 0 s; a mapping of num"),
        (lambda t: [t], r"returned \[0.0\] at 0 s; a mapping of numbers"),
        (lambda t: {"joint1": math.nan}, "at 0 s; a number was expected for j"),
    ],
)
def test_a_function_that_is_none_is_told_in_a_line(disturbance: Any, said: str) -> None:
    with pytest.raises(InputError, match=said) as refused:
        sr.Scenario(duration=0.1, disturbance=disturbance).check()
    assert "\n" not in str(refused.value)


def test_a_function_is_sampled() -> None:
    columns = sr.sampled(lambda t: np.arange(6.0) * t, 0.02, period=0.01)
    assert columns["time"] == [0.0, 0.01, 0.02]
    assert columns["base_torque_z"] == [0.0, 0.05, 0.1]
    for words in ({"duration": 0.0}, {"duration": 1.0, "period": -1.0}):
        with pytest.raises(InputError, match="a number above 0 was expected"):
            sr.sampled(wind, **words)
