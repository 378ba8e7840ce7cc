"""The robots of a flight: the true robot, and the robot assumed by the controller."""

from __future__ import annotations

import copy
from functools import cached_property
from typing import Any

from space_robot_model.robot import Robot
from space_robot_model.robot.find import robot_source
from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.errors import InputError

from .node_settings import FlightSettings
from .objects import robot_setting


class Robots:
    """The robots of plant and controller, which have the same joints.

    Raises:
        InputError: a robot does not exist, or its joints differ from the plant's.
    """

    def __init__(
        self,
        settings: FlightSettings,
        robot: str | Robot | Tree,
        plant_robot: str | Robot | Tree | None = None,
    ) -> None:
        """Read the robots.

        Args:
            settings: of the nodes, which name the robots.
            robot: option of the flight.
            plant_robot: option of the flight; the plant's robot, overriding its settings.
        """
        sources = {} if isinstance(robot, str) else {robot_setting(robot): _source(robot)}

        def source(name: str) -> _Source:
            if name not in sources:
                sources[name] = _source(name)
            return sources[name]

        plant = source(settings.plant.robot) if plant_robot is None else _source(plant_robot)
        controller, mission = source(settings.controller.robot), source(settings.mission.robot)
        for node, other in (("controller", controller.robot), ("mission", mission.robot)):
            if _names(other) != _names(plant.robot):
                raise InputError(
                    f"the robots of plant and {node} must have the same joints, got "
                    f"{plant.robot.name!r} with {', '.join(plant.robot.all_joint_names)} and "
                    f"{other.name!r} with {', '.join(other.all_joint_names)}"
                )
        self._plant, self._controller = plant, controller

    def with_plant(self, robot: Robot) -> Robots:
        """Return the same robots but for the plant's, which has the same joints."""
        robots = copy.copy(self)
        robots._plant = _Source(robot)
        return robots

    @property
    def plant(self) -> Robot:
        """The true robot."""
        return self._plant.robot

    @property
    def controller(self) -> Robot:
        """The robot assumed by the flight software."""
        return self._controller.robot

    @property
    def description(self) -> dict[str, Any]:
        """Numbers of the plant's robot, and of the controller's if it differs."""
        plant, controller = self._plant.content, self._controller.content
        own = {"controller_robot": self.controller.name, "controller_robot_file": controller}
        return {"robot_file": plant, **({} if controller == plant else own)}

    @property
    def options(self) -> dict[str, Any]:
        """The robots' numbers as options of a flight."""
        plant, controller = self._plant.content, self._controller.content
        return {"robot": controller, **({} if controller == plant else {"plant_robot": plant})}


class _Source:
    def __init__(self, robot: Robot, content: dict[str, Any] | None = None) -> None:
        self.robot, self._content = robot, content

    @cached_property
    def content(self) -> dict[str, Any]:
        """The numbers in the robot's file; of a robot in memory, its own."""
        return self.robot.content if self._content is None else self._content


def _source(robot: str | Robot | Tree) -> _Source:
    if isinstance(robot, str):
        file = robot_source(robot)
        return _Source(file.robot, file.content)
    if isinstance(robot, Robot):
        return _Source(robot)
    return _Source(Robot.from_dict(robot), robot)


def _names(robot: Robot) -> tuple[tuple[str, ...], ...]:
    return robot.joint_names, robot.passive_names
