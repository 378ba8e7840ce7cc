"""Saturation, latency, and commands that were not applied."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from space_robot_control.analysis import analyse
from space_robot_control.analysis.actuation import (
    TorqueLimits,
    differing_commands,
    latency,
    saturated_ticks,
)
from space_robot_control.flight.plan import Flight, FlightPlan
from space_robot_control.flight.simulate import simulate
from space_robot_msgs_py.flight_log import FlightLog

NONE = TorqueLimits(np.inf, np.inf)


def flown(**options: Any) -> FlightLog:
    return simulate(Flight(FlightPlan.model_validate({"duration": 0.2, **options})))


@pytest.mark.parametrize("ticks", [0, 1, 4])
def test_in_lockstep_every_command_is_applied(ticks: int) -> None:
    log = flown(command_latency_ticks=ticks)
    assert differing_commands(log, ticks, NONE) == (0, 399 - ticks)
    other = differing_commands(log, ticks + 1, NONE)
    assert other is not None
    assert other[0] > 300


def test_a_command_held_is_one_that_differs() -> None:
    log = flown()
    log.applied_torque[100] = log.applied_torque[99]
    assert differing_commands(log, 0, NONE) == (1, 399)


def test_ticks_without_a_command_are_not_compared() -> None:
    log = flown()
    assert log.commanded_torque is not None
    log.commanded_torque[50:60] = np.nan
    assert differing_commands(log, 0, NONE) == (0, 389)


def test_without_commands_nothing_is_known() -> None:
    log = flown(duration=0.01)
    log.commanded_torque = None
    assert differing_commands(log, 0, NONE) is None
    assert analyse(log)["unavailable"]["misses"] == "the commands were not recorded"


def test_saturation_is_the_plants() -> None:
    parameters = {"plant": {"base_torque_limit": 0.05, "joint_torque_limit": 0.02}}
    flight = Flight(FlightPlan(duration=0.2, parameters=parameters))
    log = simulate(flight)
    log.flight["parameters"] = {"plant": {"case": "1", **parameters["plant"]}}
    limits = TorqueLimits(0.05, 0.02)
    counted = saturated_ticks(log, limits)
    # the plant's own count has no torque at tick 0, but one more at the end
    assert 0 < counted <= int(flight.plant.block[0]["saturated_ticks"]) <= counted + 1
    assert differing_commands(log, 0, limits) == (0, 399)
    raw = differing_commands(log, 0, NONE)
    assert raw is not None
    assert raw[0] > 0
    report = analyse(log)["saturation"]
    assert (report["base_torque_limit_n_m"], report["joint_torque_limit_n_m"]) == (0.05, 0.02)
    assert (report["ticks"], report["share"]) == (counted, counted / 400)


def test_without_limits_the_report_says_so() -> None:
    report = analyse(flown(duration=0.01))["saturation"]
    assert report == {
        "base_torque_limit_n_m": None, "joint_torque_limit_n_m": None, "ticks": 0, "share": 0.0,
    }  # fmt: skip


def test_percentiles_of_the_latency() -> None:
    values = np.append(np.arange(1.0, 102.0) * 1e-5, np.nan)
    found = latency(values, 0.0005)
    assert found is not None
    assert found["answers"] == 101
    assert found["p50_ms"] == pytest.approx(0.51)
    assert found["p99_ms"] == pytest.approx(1.0)
    assert found["max_ms"] == pytest.approx(1.01)
    assert found["max_ticks"] == pytest.approx(2.02)
    assert latency(np.full(3, np.nan), 0.0005) is None
    assert "not flown as a graph" in analyse(flown(duration=0.01))["unavailable"]["latency"]
