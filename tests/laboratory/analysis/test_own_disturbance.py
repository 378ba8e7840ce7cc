"""The momentum budget and the torques by source know of a disturbance of the user's own."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles import rotation_of

import space_robot as sr
from space_robot.analysis import analyze
from space_robot.analysis.report_tables import comparison_table
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]
WIND = {
    "time": [0.1, 0.4, 0.8],
    "base_force_y": [0.5, -1.0, 2.0],
    "base_torque_x": [0.3, 0.3, -0.1],
    "joint2": [0.5, 0.0, 0.5],
}


def without(log: FlightLog) -> FlightLog:
    """The same flight whose bag does not tell of the table."""
    flight: Any = copy.deepcopy(dict(log.flight))
    flight["parameters"]["plant"]["disturbance.table"] = ""
    del flight["disturbance"]
    return replace(log, flight=flight)


def test_momentum_with_wheels_is_kept_but_for_the_users_impulse() -> None:
    log = sr.Scenario(actuators="wheels", disturbance=WIND, duration=1.0).fly().log
    drift = analyze(log)["momentum"]["drift"]["n_m_s"]
    unaware = analyze(without(log))["momentum"]["drift"]["n_m_s"]
    assert unaware > 0.1
    assert drift < 1e-5 * unaware


def test_its_torque_is_a_source_among_those_of_an_orbit() -> None:
    """About the common centre of mass, on inertial axes, as the attitude and the places say."""
    scenario = sr.Scenario(orbit="iss", disturbance=WIND, duration=1.0)
    flight = scenario.fly()
    report, log = analyze(flight.log), flight.log
    own = report["disturbance_by_source"]["own"]
    rows = [
        np.interp(log.time, WIND["time"], WIND[name], left=0.0, right=0.0)
        for name in ("base_torque_x", "base_force_y")
    ]
    rows = [np.where(log.time < 0.8 - 1e-9, row, 0.0) for row in rows]
    axes = rotation_of(log.quaternion[0])
    assert own["max_n_m"] > 0.3 / 2.0
    pure = {"time": WIND["time"], "base_torque_x": WIND["base_torque_x"]}
    turned = analyze(scenario.replace(disturbance=pure).fly().log)["disturbance_by_source"]["own"]
    assert turned["max_n_m"] == pytest.approx(0.3, rel=1e-9)
    assert turned["rms_n_m"] == pytest.approx(np.sqrt(np.mean(rows[0] ** 2)), rel=1e-9)
    impulse = np.linalg.norm(axes.apply([np.max(np.abs(np.cumsum(rows[0]))) * 0.0005, 0.0, 0.0]))
    assert turned["impulse_n_m_s"] == pytest.approx(impulse, rel=1e-3)
    assert "own" in str(comparison_table({"a": report}))
    assert "own" not in analyze(without(log))["disturbance_by_source"]
