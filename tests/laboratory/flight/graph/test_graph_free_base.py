"""A base that nothing turns, on the real graph: the flight that `simulate` flies, to the bit."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest
from flights import Flown

from space_robot.analysis import analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")

COLUMNS = (
    "base_position",
    "quaternion",
    "omega_base",
    "joint_positions",
    "joint_velocities",
    "applied_torque",
    "commanded_torque",
)


def test_a_free_base_drifts_in_the_graph_as_in_one_process(fly: Callable[..., Flown]) -> None:
    """From one law to another, disturbed, and told in the same report."""
    options = ("--actuators", "none", "--case", "3", "--swap", "0.3:ctc", "--duration", "0.5")
    flown = fly(*options, "--composed")
    plan = FlightPlan(actuators="none", case="3", swaps=["0.3:ctc"], duration=0.5)
    log, recorded = simulate(Flight(resolve(plan))), read_flight(flown.bag)
    for column in COLUMNS:
        np.testing.assert_array_equal(getattr(recorded, column), getattr(log, column), column)
    assert recorded.flight == log.flight
    assert recorded.flight["actuators"] == "none"
    here, there = json.loads(json.dumps(analyze(log))), flown.bag_report
    for key in ("latency", "unavailable"):  # of the wall clock; the simulated flight has none
        assert here.pop(key) != there.pop(key)
    assert here == there
    assert there["attitude_drift"]["end_deg"] > 0.0
    assert "attitude" not in there["maxima"]
