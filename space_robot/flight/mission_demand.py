"""What the segments of a mission ask of the base's actuators, checked before a flight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.demand import demand
from space_robot_model.hardware.capability import limits_of, shares_of
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from ..scenario.resolved import ResolvedScenario

Array = NDArray[np.float64]


def check_mission_demand(scenario: ResolvedScenario) -> None:
    """Check that the actuators that the flight software assumes can give what segments ask for.

    The demand is that of the nominal robot without friction, from zero momentum. Missions of
    waypoints only are not checked, nor those with ``limits: {check_actuators: false}``.

    Raises:
        InputError: a torque or momentum is too large; names segment, axis, time and amounts.
    """
    mission, hardware = scenario.mission, scenario.assumed_actuators
    is_checked = mission.limits.check_actuators and mission.has_segments
    if not is_checked or hardware.base_actuation != "hardware":
        return
    torque, momentum = limits_of(hardware)
    robot = scenario.robots.controller.nominal
    for number, piece in enumerate(scenario.reference.pieces, 1):
        asked = demand(robot, piece.joints, piece.base, piece.begin, piece.end)
        name = f"the mission's part {number} ({piece.motion})"
        _check(name, asked.time, asked.torque[:, :3], torque, "N m")
        _check(name, asked.time, asked.base_momentum, momentum, "N m s")


def _check(name: str, time: Array, asked: Array, limit: Array, unit: str) -> None:
    shares = shares_of(limit, asked)
    k, axis = np.unravel_index(int(np.argmax(shares)), shares.shape)
    if shares[k, axis] > 1.0:
        raise InputError(
            f"{name} asks for {abs(asked[k, axis]):.4g} {unit} about {BASE_AXES[axis]} at "
            f"t = {time[k]:.2f} s, the actuators give {limit[axis]:.4g} {unit}: use `space-robot "
            "plan` to stretch it, or limits: {check_actuators: false}"
        )
