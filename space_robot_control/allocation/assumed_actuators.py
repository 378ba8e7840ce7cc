"""Base actuators assumed by the flight software, from its own actuators' file."""

from __future__ import annotations

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.sheets import read_sheet
from space_robot_model.robot import Robot


def assumed_actuators(name: str, robot: Robot) -> BaseActuatorSettings:
    """Read the hardware of a file of config/actuators, or at a path, for a robot.

    Raises:
        InputError: there is no such file, or it is wrong.
    """
    actuators = read_sheet(BaseActuatorSettings, "actuators", name)
    actuators.check(robot, name)
    return actuators
