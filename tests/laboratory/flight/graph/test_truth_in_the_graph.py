"""Flights with sensors and drives that err: the graph's truth is that of one process."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from flights import Flown, space_robot_here

from space_robot.analysis import analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.reader import read_flight

FAULTS = [
    "noise_gyro@0.1-0.4:1e-6",
    "noise_attitude@0:1e-5",
    "quantise_joint_position@0.2:1e-5",
    "torque_scale@0.3:joints=0.998",
]


@pytest.mark.parametrize(("lost", "how"), [([], ()), (["drop_state@0-0.5:0.02"], ("--composed",))])
def test_truth_measured_and_assumed_are_those_of_one_process(
    fly: Callable[..., Flown], lost: list[str], how: tuple[str, ...]
) -> None:
    """To the last bit, and so is the report; nothing is lost, but for what a fault keeps back."""
    faults = [*FAULTS, *lost]
    given = [word for fault in faults for word in ("--fault", fault)]
    flown = fly("--duration", "0.5", *given, *how)
    log = simulate(Flight(resolve(FlightPlan(faults=faults, duration=0.5))))
    recorded = read_flight(flown.bag)
    assert recorded.lost == {topic.full_name: 0 for topic in topics.ALL}
    assert recorded.measured is not None
    assert log.measured is not None
    for name, column in log.measured.columns.items():
        np.testing.assert_array_equal(getattr(recorded, name), getattr(log, name), name)
        np.testing.assert_array_equal(getattr(recorded.measured, name), column, name)
    for name in ("quaternion", "omega_base", "joint_positions", "applied_torque"):
        assert np.any(getattr(log, name) != getattr(log.measured, name)), name
    np.testing.assert_array_equal(recorded.assumed_error, log.assumed_error)
    here, there = json.loads(json.dumps(analyze(log))), flown.bag_report
    for key in ("latency", "unavailable"):
        assert here.pop(key) != there.pop(key)
    assert here == there


def test_a_replay_plays_what_was_measured(tmp_path: Path) -> None:
    """The controller answers it as in flight, to the last bit: it never sees the truth."""
    plan = FlightPlan(faults=FAULTS, duration=0.4, sensors="fine", navigation="filtered")
    simulate(Flight(resolve(plan)), tmp_path / "bag")
    replayed = space_robot_here("replay", str(tmp_path / "bag"), "--json")
    assert replayed.returncode == 0, replayed.stderr
