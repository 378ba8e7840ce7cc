"""Wheels and thrusters of a recorded flight in its scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.described import flown_actuators
from .plumes import DrawnPlumes, PlumeFrames
from .scene import RobotScene
from .trails import Move
from .wheels import DrawnWheels, WheelFrames

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]


def actuators(
    scene: SceneApi, robot_scene: RobotScene, log: FlightLog, robot: Robot, times: Array, dark: bool
) -> list[Move]:
    """Draw wheels and thrusters of a flight's base; nothing if the bag does not describe them.

    Args:
        scene: of a server.
        robot_scene: the robot in it.
        log: the flight.
        robot: that flew.
        times: (K,) of the frames, s.
        dark: whether the page is light on dark.
    """
    flown = described_actuators(log)
    moves: list[Move] = []
    if flown.wheel_count:
        wheels = DrawnWheels(scene, robot_scene, robot, flown.wheels)
        motion = WheelFrames.of(log, flown.wheels, times)
        moves.append(lambda k: wheels.move(motion.angles[k], motion.is_saturated[k]))
    if flown.thruster_count:
        plumes = DrawnPlumes(scene, robot_scene, robot, flown.thrusters, dark)
        thrusts = PlumeFrames.of(log, times).thrusts
        moves.append(lambda k: plumes.move(thrusts[k]))
    return moves


def actuator_notes(log: FlightLog, times: Array) -> list[str]:
    """Say how wheels and plumes of a flight are drawn, a sentence each.

    Args:
        log: the flight.
        times: (K,) of the frames, s.
    """
    flown = described_actuators(log)
    slowdown = WheelFrames.of(log, flown.wheels, times).slowdown if flown.wheel_count else 1.0
    return drawing_notes(flown, slowdown)


def drawing_notes(flown: BaseActuatorSettings, slowdown: float) -> list[str]:
    """Say how actuators are drawn whose wheels turn so many times slower, a sentence each."""
    notes = []
    if flown.wheel_count:
        speed = (
            "as fast as in flight"
            if slowdown == 1.0
            else f"{slowdown:g} times slower than in flight"
        )
        notes.append(f"Wheels turn {speed}; red: at a limit of torque or momentum.")
    if flown.thruster_count:
        force = float(flown.thrusters.values("force").max())
        notes.append(f"Plumes are as long as the mean thrust is large, the longest {force:g} N.")
    return notes


def described_actuators(log: FlightLog) -> BaseActuatorSettings:
    """Return the actuators of a flight's base; none if its bag does not describe them."""
    try:
        return flown_actuators(log)
    except InputError:
        return BaseActuatorSettings()
