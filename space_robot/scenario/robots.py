"""The robots of a flight: the true robot, and the robot assumed by the controller."""

from __future__ import annotations

from typing import Any, NamedTuple

from space_robot_model.robot import Robot
from space_robot_model.robot.find import robot_source
from space_robot_msgs_py.config.trees import Tree
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
        self.plant, self.controller = plant.robot, controller.robot
        self._plant_content, self._controller_content = plant.content, controller.content

    @property
    def description(self) -> dict[str, Any]:
        """Numbers of the plant's robot, and of the controller's if it differs."""
        plant, controller = self._plant_content, self._controller_content
        own = {"controller_robot": self.controller.name, "controller_robot_file": controller}
        return {"robot_file": plant, **({} if controller == plant else own)}

    @property
    def options(self) -> dict[str, Any]:
        """The robots' numbers as options of a flight."""
        plant, controller = self._plant_content, self._controller_content
        return {"robot": controller, **({} if controller == plant else {"plant_robot": plant})}


class _Source(NamedTuple):
    robot: Robot
    content: dict[str, Any]
    """The numbers in the robot's file."""


def _source(robot: str | Robot | Tree) -> _Source:
    if isinstance(robot, str):
        file = robot_source(robot)
        return _Source(file.robot, file.content)
    if isinstance(robot, Robot):
        return _Source(robot, robot.content)
    return _Source(Robot.from_dict(robot), robot)


def _names(robot: Robot) -> tuple[tuple[str, ...], ...]:
    return robot.joint_names, robot.passive_names
