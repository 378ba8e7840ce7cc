"""Momentum of flights in orbit with magnetic torquers, and the torques from outside by source."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from space_robot.analysis import analyze
from space_robot.analysis.described import momentum_of
from space_robot.analysis.external_torques import DisturbanceBySource
from space_robot.analysis.momentum import Momentum
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import SOURCES
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.plant.settings import PlantNodeSettings
from space_robot_sim.plant.surroundings import REPORT_TICKS

Array = NDArray[np.float64]

ELEMENTS = {"height": 420e3, "inclination_deg": 51.6, "anomaly_deg": 30.0}
FIELD = {
    "orbital_elements": ELEMENTS,
    "gravity": {"gradient": False},
    "magnetism": {"strength": 2.98e-5, "residual_dipole": [10.0, -20.0, 30.0]},
}
ORBITS: dict[str, Any] = {
    "field": FIELD,
    "gravity": {**FIELD, "gravity": {"gradient": True}},
    "air": {**FIELD, "atmosphere": {"density": 3e-12, "at_height": 420e3}},
    "all": {
        **FIELD,
        "gravity": {"gradient": True, "j2": True},
        "atmosphere": {"density": 3e-12, "at_height": 420e3},
        "sunlight": {"pressure": 4.56e-6, "noon_deg": 30.0},
    },
}


@cache
def flown(orbit: str, period: float = 5e-4, duration: float = 2.0, **options: Any) -> FlightLog:
    plan = {
        "actuators": "wheels_and_torquers",
        "orbit": ORBITS[orbit],
        "period": period,
        "duration": duration,
        **options,
    }
    return simulate(Flight(resolve(FlightPlan.model_validate(plan))))


def remainder(log: FlightLog) -> tuple[Momentum, Array]:
    """Return the momentum of a flight, and what of its change is not accounted for, (N, 3)."""
    momentum = momentum_of(log).add(log)
    return momentum, momentum.total - momentum.total[0] - momentum.outside


def test_dipoles_are_accounted_for_to_rounding() -> None:
    """Those of torquers and that of the base: their torques are held on base axes over a tick."""
    log = flown("field")
    momentum, rest = remainder(log)
    size = np.linalg.norm(momentum.wheels, axis=1).max()
    assert size > 10.0
    assert np.linalg.norm(momentum.outside[-1]) > 1e-3
    assert np.abs(rest).max() < 1e-13 * size
    found = analyze(log)["momentum"]
    assert found["drift"]["n_m_s"] == pytest.approx(np.linalg.norm(rest, axis=1).max())
    assert found["peak_n_m_s"]["outside"] == np.linalg.norm(momentum.outside, axis=1).max()


def test_without_the_torquers_part_it_would_not_be() -> None:
    """Their torque is what the base is applied beyond its wheels' motors."""
    log = flown("field")
    other = replace(log, applied_torque=log.applied_torque.copy())
    axes = np.array([[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]) / np.sqrt(3.0)
    other.applied_torque[:, :3] = -log.wheel_torques @ axes
    lost = np.linalg.norm(remainder(other)[1][-1])
    dipoles = log.actuator_commands[:-1, 4:]
    held = np.cross(dipoles, log.magnetic_field[:-1]).sum(axis=0) * log.timebase.period
    assert lost == pytest.approx(np.linalg.norm(held), rel=1e-3)  # on base axes, nearly inertial


def test_thrusters_and_torquers_together_are_accounted_for() -> None:
    """On a base with all three, whose thrusters fire."""
    files = [
        PlantNodeSettings.resolve({"actuators": name}).model_dump()
        for name in ("wheels_and_thrusters", "wheels_and_torquers")
    ]
    hardware = {
        "base_actuation": "hardware",
        "wheels": files[1]["wheels"],
        "thrusters": files[0]["thrusters"],
        "magnetic_torquers": files[1]["magnetic_torquers"],
    }
    unloading = {"allocation.unload_above": 0.1, "allocation.unload_to": 0.05}
    plan = FlightPlan(
        actuators=hardware, orbit=FIELD, duration=0.5, parameters={"controller": unloading}
    )
    log = simulate(Flight(resolve(plan)))
    momentum, rest = remainder(log)
    assert log.thrusts.any(axis=0).sum() > 1
    assert np.abs(log.actuator_commands[:, 16:]).max(axis=0).all()
    assert np.linalg.norm(momentum.outside[-1]) > 0.1
    assert np.abs(rest).max() < 1e-12 * np.linalg.norm(momentum.wheels[0])


@pytest.mark.parametrize("period", [5e-4, 2e-3])
def test_what_remains_with_gravity_is_that_its_torque_is_held(period: float) -> None:
    """It is computed every 20 ticks and summed as if it stayed the same until then.

    The sum of a torque that grows lags by half of that time: by 10 periods times what it grew.
    """
    log = flown("gravity", period, 4.0)
    rest = remainder(log)[1]
    gravity = log.external_torques[:, :3]
    last = (log.ticks - 1) // REPORT_TICKS * REPORT_TICKS
    lag = 0.5 * REPORT_TICKS * period * (gravity[last] - gravity[0])
    size = np.linalg.norm(lag)
    assert size > 1e-7
    np.testing.assert_allclose(rest[last], lag, rtol=0.0, atol=0.01 * size)
    assert np.linalg.norm(rest[-1]) < 1e-6 * np.linalg.norm(log.wheel_velocities[0])


def test_what_remains_with_air_is_that_the_centre_of_mass_moves() -> None:
    """Its force is held over a tick, in which its lever changes with the arm: by the period."""
    sizes = []
    for period in (5e-4, 1e-3):
        momentum, rest = remainder(flown("air", period))
        sizes.append(np.abs(rest).max())
        assert sizes[-1] < 1e-5 * np.linalg.norm(momentum.outside[-1])
    assert sizes[1] == pytest.approx(2.0 * sizes[0], rel=0.05)


def test_the_report_has_the_columns_of_the_log_by_source() -> None:
    """Without another disturbance there are no more sources; torquers are none."""
    log = flown("all", case="1")
    found = analyze(log)["disturbance_by_source"]
    assert tuple(found) == SOURCES
    assert_figures(found, by_source(log), log.timebase.period)
    assert all(figures["rms_n_m"] > 0.0 for figures in found.values())


def by_source(log: FlightLog) -> dict[str, Array]:
    return {name: log.external_torques[:, 3 * k : 3 * k + 3] for k, name in enumerate(SOURCES)}


def assert_figures(found: dict[str, Any], torques: dict[str, Array], period: float) -> None:
    assert set(found) == set(torques)
    for name, torque in torques.items():
        sizes = np.linalg.norm(torque, axis=1)
        impulse = np.linalg.norm(period * np.cumsum(torque, axis=0), axis=1)
        expected = {
            "rms_n_m": np.sqrt(np.mean(sizes**2)),
            "max_n_m": sizes.max(),
            "impulse_n_m_s": impulse.max(),
        }
        assert found[name] == pytest.approx(expected, rel=1e-12), name


def test_sines_are_a_source_of_their_own() -> None:
    """``-0.01 (sin(pi t) + sin(1.5 pi t))`` on each inertial axis, as case 3 has it."""
    log = flown("all", case="3")
    wave = -0.01 * (np.sin(np.pi * log.time) + np.sin(1.5 * np.pi * log.time))
    found = analyze(log)["disturbance_by_source"]
    assert tuple(found) == (*SOURCES, "sines")
    torques = {**by_source(log), "sines": np.repeat(wave[:, np.newaxis], 3, axis=1)}
    assert_figures(found, torques, log.timebase.period)
    assert found["sines"]["max_n_m"] == pytest.approx(np.sqrt(3.0) * np.abs(wave).max())


@pytest.mark.parametrize("cuts", [(1,), (7, 2000, 3999)])
def test_figures_do_not_depend_on_the_blocks(cuts: tuple[int, ...]) -> None:
    log = flown("all", case="1")
    metric = DisturbanceBySource(DisturbanceSettings())
    for start, stop in zip((0, *cuts), (*cuts, log.ticks), strict=True):
        metric.add(log.rows(start, stop), np.empty(0))
    assert_figures(metric.result(), by_source(log), log.timebase.period)


def test_a_bag_has_the_same_figures(tmp_path: Path) -> None:
    plan = FlightPlan(
        actuators="wheels_and_torquers", orbit="iss", duration=0.1, sensors="fine", case="3"
    )
    log = simulate(Flight(resolve(plan)), tmp_path / "bag")
    report, recorded = analyze(log), analyze(read_flight(tmp_path / "bag"))
    for key in ("momentum", "disturbance_by_source"):
        assert recorded[key] == report[key]


def test_flights_without_an_orbit_have_none() -> None:
    log = simulate(Flight(resolve(FlightPlan(duration=0.05))))
    assert analyze(log)["disturbance_by_source"] is None


@pytest.mark.parametrize("lost", [0, 4, 9])
def test_ticks_whose_torques_are_lost_are_left_out(lost: int, tmp_path: Path) -> None:
    """As of a plant that was killed: its last ticks were not told yet.

    Their impulse is not known, so that a budget beyond them would be wrong without a word.
    """
    flight = Flight(resolve(FlightPlan(actuators="wheels_and_torquers", orbit="iss", duration=0.1)))
    simulate(flight, tmp_path / "whole")
    whole = open_bag(tmp_path / "whole")
    described = json.loads(whole.custom_data()["space_robot.flight"])
    recorder, chunk = BagRecorder(tmp_path / "bag", described, flight.timebase), -1
    for name, data in whole.messages(*topics.ALL):
        chunk += name == topics.TRUTH_ORBIT.full_name
        if name != topics.TRUTH_ORBIT.full_name or chunk != lost:
            recorder.record(topics.BY_NAME[name], data)
    recorder.close()
    log = read_flight(tmp_path / "bag")
    report = analyze(log)
    json.dumps([report["momentum"], report["disturbance_by_source"]], allow_nan=False)
    assert report["momentum"]["peak_n_m_s"]["outside"] > 0.0
    assert (report["from_s"], report["to_s"]) == {0: (0.01, 0.1), 4: (0.05, 0.1), 9: (0.0, 0.09)}[
        lost
    ]
