"""Segments that ask the base's actuators for too much are refused before the flight."""

from __future__ import annotations

from typing import Any

import pytest

import space_robot as sr
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_msgs_py.errors import InputError

LINE = {"tool": {"xyz": [0.3, 0.0, -0.4]}}
SLOW_TURN = {"base": {"rpy_deg": [0, 0, 30]}, "duration": 60}


def flight(segment: dict[str, Any], actuators: str, **limits: bool) -> Flight:
    mission = {
        "start": {"joints_deg": [0, 90, 200, 20, 30, 10]},
        "segments": [segment],
        **({"limits": limits} if limits else {}),
    }
    return Flight(resolve(FlightPlan(actuators=actuators, mission=mission, controller="ctc")))


def test_torque_and_momentum_are_named_with_axis_time_and_amounts() -> None:
    with pytest.raises(InputError) as told:
        flight({**LINE, "duration": 3}, "wheels")
    assert "the mission's part 1 (tool) asks for " in str(told.value)
    assert " N m about base_y at t = 2." in str(told.value)
    assert "\n" not in str(told.value)
    half_turn = {"base": {"rpy_deg": [0, 0, 179]}, "duration": 58}
    with pytest.raises(InputError, match=r"asks for .* N m s about base_z at t = 29\.00 s"):
        flight(half_turn, "wheels")


@pytest.mark.parametrize(
    ("segment", "actuators", "limits"),
    [
        ({**LINE, "duration": 3}, "ideal", {}),
        ({**LINE, "duration": 3}, "none", {}),
        ({**LINE, "duration": 30}, "wheels", {}),
        (SLOW_TURN, "thrusters", {}),
        ({**SLOW_TURN, "duration": 30}, "small_wheels", {"check_actuators": False}),
    ],
)
def test_what_they_can_give_is_flown(
    segment: dict[str, Any], actuators: str, limits: dict[str, bool]
) -> None:
    assert flight(segment, actuators, **limits).mission.duration == segment["duration"]


def test_missions_of_waypoints_are_flown_as_ever() -> None:
    assert sr.Scenario(actuators="small_wheels", controller="ctc", duration=0.05).fly().log.ticks
