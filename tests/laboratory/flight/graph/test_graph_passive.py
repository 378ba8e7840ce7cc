"""A robot with passive and prismatic joints on the real graph: as `simulate` flies it, replayed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from flights import Flown
from passive_robot import PASSIVE_ROBOT

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.replay.outcome import ReplayOptions
from space_robot.flight.replay.run import replay
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")

COLUMNS = (
    "quaternion",
    "joint_positions",
    "joint_velocities",
    "passive_positions",
    "passive_velocities",
    "applied_torque",
    "commanded_torque",
)


def test_passive_joints_swing_in_the_graph_as_in_one_process(
    fly: Callable[..., Flown], domain: int
) -> None:
    """Under a law with a model and one without; a replay gives the same commands to the bit."""
    flown = fly("--robot", PASSIVE_ROBOT, "--swap", "0.3:ctc", "--duration", "0.5", "--composed")
    plan = FlightPlan(robot=PASSIVE_ROBOT, swaps=["0.3:ctc"], duration=0.5)
    log, recorded = simulate(Flight(resolve(plan))), read_flight(flown.bag)
    assert recorded.flight == log.flight
    for column in COLUMNS:
        np.testing.assert_array_equal(getattr(recorded, column), getattr(log, column), column)
    assert np.abs(recorded.passive_velocities).max() > 0.0
    assert set(flown.report["rms"]["mean_axis"]) >= {"joints_revolute", "joints_prismatic"}
    again = replay(ReplayOptions(flown.bag, domain=domain, trust=True))
    assert again.comparison.is_identical
    assert [axis["unit"] for axis in again.report()["axes"].values()] == [
        *["N m"] * 4,
        "N",
        *["N m"] * 4,
    ]
