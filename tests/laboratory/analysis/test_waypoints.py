"""Waypoints of hand-made references: where the arm shall rest."""

from __future__ import annotations

import numpy as np
import pytest

from space_robot.analysis.waypoints import junction_ticks, waypoint_ticks
from space_robot.flight.flown_log import empty_log
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_msgs_py.bag.flight_log import FlightLog


def log_with_speed(speed: np.ndarray) -> FlightLog:
    """One joint moves with the given speeds, the others rest."""
    log = empty_log(Flight(resolve(FlightPlan(duration=len(speed) * 0.0005))))
    log.reference_joints[:] = 0.0
    log.reference_joints[:, 1, 2] = speed
    return log


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_between_two_motions_is_one(sign: float) -> None:
    """The start, the junction and the end, whichever way the joint turns."""
    time = np.linspace(0.0, 2.0, 201)
    log = log_with_speed(sign * 1e-3 * np.sin(np.pi * time) ** 4)
    assert waypoint_ticks(log).tolist() == [0, 100, 200]
    assert junction_ticks(log).tolist() == [100]


def test_a_longer_rest_has_two_ends() -> None:
    speed = np.concatenate([np.zeros(5), np.full(10, 0.2), np.zeros(7), np.full(10, 0.1)])
    assert waypoint_ticks(log_with_speed(speed)).tolist() == [0, 4, 15, 21]


def test_slow_is_not_at_rest_unless_it_is_the_slowest_between_two_ticks() -> None:
    """A ten-thousandth of the highest speed is near a waypoint; the slowest tick there is it."""
    speed = np.ones(20)
    speed[7:10] = 5e-5, 2e-5, 6e-5
    assert waypoint_ticks(log_with_speed(speed)).tolist() == [8]


def test_an_arm_that_never_moves_has_its_start() -> None:
    assert waypoint_ticks(log_with_speed(np.zeros(20))).tolist() == [0]


def test_an_unknown_speed_is_no_rest() -> None:
    """Ticks whose reference is missing."""
    speed = np.ones(20)
    speed[:3], speed[15] = 0.0, np.nan
    assert waypoint_ticks(log_with_speed(speed)).tolist() == [0, 2]
