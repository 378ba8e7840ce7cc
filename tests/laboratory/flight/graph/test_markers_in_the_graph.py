"""A viewer that listens to /markers in flight sees the robot where it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from flights import Start

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_model.robot import Robot
from space_robot_model.robot.markers import RobotMarkers
from space_robot_model.robot.poses import RobotPoses
from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.markers import no_markers

pytest.importorskip("rclpy")
pytest.importorskip("visualization_msgs")

if TYPE_CHECKING:
    from ground import Ground

EVERY = 67
"""Ticks of 0.5 ms from one message to the next: 30 Hz at most."""


def test_markers_are_those_of_the_states(start: Start, ground: Ground, paper_robot: Robot) -> None:
    """Those of a flight before are taken away, then each is that of its tick, to the last bit."""
    from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription

    seen = RawSubscription(ground.node, topics.MARKERS, PolledCallbackGroup(), 1_000)
    start("controller")
    start("mission")
    plant = start("plant", ticks=600)
    output, _ = plant.communicate(timeout=90)
    assert plant.returncode == 0, output
    found = list(iter(seen.take, None))
    log = simulate(Flight(resolve(FlightPlan(duration=0.3))))
    poses, markers = RobotPoses(paper_robot), RobotMarkers(paper_robot, Timebase(500_000))
    expected = [
        markers.encode(tick, poses.at(log.state(tick))) for tick in range(0, log.ticks, EVERY)
    ]
    assert len(found) > 4
    assert found[0].startswith(no_markers())  # the middleware fills messages up to whole words
    for data, ours in zip(reversed(found[1:]), reversed(expected), strict=False):
        assert data.startswith(ours)
