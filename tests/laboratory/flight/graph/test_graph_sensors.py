"""Sensors that are not ideal, on the real graph: the flight that `simulate` flies.

To the last bit, the truth and what the sensors told of it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from flights import Flown

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")

FAULTS = (
    "noise_gyro@0.1-0.3:1e-6",
    "gyro_bias@0.2:base_y=1e-7",
    "tracker_blind@0.25-0.27",
    "encoder_stuck@0.3-0.305:6",
    "saturate_joints@0.35-0.36:5",
    "torque_scale@0.1:all=1.001",
)
COLUMNS = (
    "quaternion",
    "angular_velocity",
    "joint_positions",
    "joint_velocities",
    "applied_torque",
    "commanded_torque",
)


def test_sensors_and_failing_parts_fly_in_the_graph_as_in_one_process(
    fly: Callable[..., Flown],
) -> None:
    words = [word for fault in FAULTS for word in ("--fault", fault)]
    bag = fly("--sensors", "fine", "--seed", "5", "--duration", "0.5", "--composed", *words).bag
    log = read_flight(bag)
    plan = FlightPlan(sensors="fine", seed=5, duration=0.5, faults=list(FAULTS))
    expected = simulate(Flight(resolve(plan)))
    assert log.flight["sensors"] == "fine"
    for one, other in ((log, expected), (log.as_measured(), expected.as_measured())):
        for column in COLUMNS:
            np.testing.assert_array_equal(getattr(one, column), getattr(other, column), column)
    assert (log.quaternion != log.as_measured().quaternion).any()
