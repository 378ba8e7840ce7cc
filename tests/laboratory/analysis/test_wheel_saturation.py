"""Wheels at their limits, and metrics that do not blame hardware for what it cannot help."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from actuator_sets import PYRAMID, flat, hardware, still_log
from hypothesis import given
from hypothesis import strategies as st

from space_robot.analysis import analyze
from space_robot.analysis.report_tables import comparison_table
from space_robot.analysis.sizing_table import sizing_table
from space_robot.analysis.wheel_saturation import WheelSaturation
from space_robot.analysis.words import remarks
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

LIMITED = {
    "axes": flat(np.eye(3)),
    "rotor_inertia": [0.1],
    "max_torque": [0.5],
    "max_momentum": [2.0, 0.0, 2.0],
}
PERIOD = 0.0005


def saturated(log: FlightLog, actuators: BaseActuatorSettings, *cuts: int) -> dict[str, Any]:
    metric = WheelSaturation(log, actuators.wheels)
    for start, stop in zip((0, *cuts), (*cuts, log.ticks), strict=True):
        metric.add(log.rows(start, stop), np.empty(0))
    found: dict[str, Any] = metric.result()
    return found


def test_ticks_at_limits_by_wheel_and_the_first(paper_robot: Robot) -> None:
    actuators = hardware(wheels=LIMITED)
    log = still_log(paper_robot, 100, actuators)
    log.wheel_torques[10:20, 0] = -0.5
    log.wheel_velocities[15:40, 0] = -20.0
    log.wheel_velocities[:, 1] = 1e3  # without a limit
    log.wheel_torques[50, 2], log.wheel_velocities[49, 2] = 0.25, (2.0 - 0.25 * PERIOD) / 0.1
    found = saturated(log, actuators)
    assert found == {
        "ticks": 10 + 21 + 1,
        "share": 0.32,
        "wheels": {
            "wheel_1": {"torque_limit_ticks": 10, "momentum_limit_ticks": 25, "first_s": 0.005},
            "wheel_2": {"torque_limit_ticks": 0, "momentum_limit_ticks": 0, "first_s": None},
            "wheel_3": {"torque_limit_ticks": 0, "momentum_limit_ticks": 1, "first_s": 0.025},
        },
    }


@given(st.integers(0, 99), st.integers(1, 58))
def test_cuts_change_nothing(paper_robot: Robot, seed: int, cut: int) -> None:
    actuators, rng = hardware(wheels=LIMITED), np.random.default_rng(seed)
    log = still_log(paper_robot, 60, actuators)
    log.wheel_torques[:] = rng.choice([0.0, 0.5, -0.5, 0.1], size=(60, 3))
    log.wheel_velocities[:] = rng.choice([0.0, 20.0, -20.0, 3.0], size=(60, 3))
    assert saturated(log, actuators, cut) == saturated(log, actuators)


def test_it_is_said_plainly(paper_robot: Robot) -> None:
    actuators = hardware(wheels=LIMITED)
    log = still_log(paper_robot, 100, actuators)
    log.wheel_torques[10:20, 2] = 0.5
    report = analyze(log)
    assert (
        "wheels were at a limit of torque or momentum at 10 ticks (10.00%), wheel_3 first at "
        "0.005 s" in remarks(report)
    )
    table = comparison_table({"flight": report})
    texts = {(g.name, row[0]): row[1] for g in table.groups for row in table.texts(g)}
    assert texts["saturation", "wheel_1"] == "never"
    assert texts["saturation", "wheel_3"] == "torque 10, momentum 0\nfirst at 0.005 s"
    sized = {(r["part"], r["quantity"]): r["is_met"] for r in report["sizing"]["requirements"]}
    table = sizing_table(report)
    assert table is not None
    assert "what the law then asked for is not what the mission asks" in table.notes[0]
    assert not sized["wheel_3", "peak torque"]
    assert sized["wheel_1", "peak torque"]


def test_without_limits_wheels_are_never_at_one(paper_robot: Robot) -> None:
    actuators = hardware(wheels={"axes": PYRAMID})
    log = still_log(paper_robot, 10, actuators)
    log.wheel_velocities[:] = log.wheel_torques[:] = 1e6
    report = analyze(log)
    assert report["wheel_saturation"]["ticks"] == 0
    assert not any("limit" in text for text in remarks(report))


def test_ideal_bases_have_none_and_nothing_is_said_of_it(paper_robot: Robot) -> None:
    report = analyze(still_log(paper_robot, 10))
    assert report["wheel_saturation"] is None
    assert "wheel_saturation" not in report["unavailable"]


@pytest.mark.parametrize(
    "actuators",
    [hardware(wheels=LIMITED), BaseActuatorSettings(base_actuation="none"), BaseActuatorSettings()],
)
def test_a_base_that_gives_another_torque_missed_no_deadline(
    paper_robot: Robot, actuators: BaseActuatorSettings
) -> None:
    """The joints tell: they get what was commanded for the tick, or all of it came too late."""
    log = still_log(paper_robot, 100, actuators)
    rng = np.random.default_rng(0)
    assert log.commanded_torque is not None
    log.commanded_torque[:] = rng.normal(size=log.commanded_torque.shape)
    log.applied_torque[1:, 3:] = log.commanded_torque[:-1, 3:]
    is_ideal = actuators.base_actuation == "ideal"
    found = analyze(log)["missed_deadlines"]
    assert found["differing_ticks"] == (99 if is_ideal else 0)
    assert found["compared_ticks"] == 99
    log.applied_torque[50] = log.applied_torque[49]
    assert analyze(log)["missed_deadlines"]["differing_ticks"] == (99 if is_ideal else 1)


def test_the_bases_limit_is_not_that_of_its_hardware(paper_robot: Robot) -> None:
    log = still_log(paper_robot, 10, hardware(wheels=LIMITED))
    log.flight["parameters"] = {"plant": {"base_torque_limit": 0.5, "joint_torque_limit": 3.0}}
    found = analyze(log)["saturation"]
    assert found["base_torque_limit_n_m"] is None
    assert found["joint_torque_limit_n_m"] == 3.0
