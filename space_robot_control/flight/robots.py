"""The robots of a flight: what the plant is, and what the controller takes it for."""

from __future__ import annotations

from typing import Any

from space_robot_msgs_py.errors import InputError
from space_robot_sim.robot import Robot
from space_robot_sim.robot.find import robot_source

from .node_settings import FlightSettings
from .objects import robot_setting


class Robots:
    """The robots that plant and controller are told; their joints are the same.

    Raises:
        InputError: a robot that is not there, or has other joints than the plant's.
    """

    def __init__(self, settings: FlightSettings, given: str | Robot) -> None:
        """``given``: by the flight's options."""
        self._read_ones = {} if isinstance(given, str) else {robot_setting(given): given}
        self._contents = {name: robot.content for name, robot in self._read_ones.items()}
        self.plant, self.controller, mission = (
            self._read(node.robot)
            for node in (settings.plant, settings.controller, settings.mission)
        )
        self._names = settings.plant.robot, settings.controller.robot
        for node, robot in (("controller", self.controller), ("mission", mission)):
            if _names(robot) != _names(self.plant):
                raise InputError(
                    f"the robots of plant and {node} must have the same joints, got "
                    f"{self.plant.name!r} with {', '.join(self.plant.all_joint_names)} and "
                    f"{robot.name!r} with {', '.join(robot.all_joint_names)}"
                )

    def _read(self, name: str) -> Robot:
        if name not in self._read_ones:
            source = robot_source(name)
            self._read_ones[name], self._contents[name] = source.robot, source.content
        return self._read_ones[name]

    @property
    def description(self) -> dict[str, Any]:
        """The numbers of the plant's robot, and of the controller's where that is another."""
        plant, controller = (self._contents[name] for name in self._names)
        own = {"controller_robot": self.controller.name, "controller_robot_file": controller}
        return {"robot_file": plant, **({} if controller == plant else own)}


def _names(robot: Robot) -> tuple[tuple[str, ...], ...]:
    return robot.joint_names, robot.passive_names
