"""The robots of a flight: what the plant is, and what the controller takes it for."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from space_robot_model.robot import Robot
from space_robot_model.robot.find import robot_source
from space_robot_model.robot.source import RobotSource
from space_robot_msgs_py.errors import InputError

from .node_settings import FlightSettings
from .objects import robot_setting


class Robots:
    """The robots that plant and controller are told; their joints are the same.

    Raises:
        InputError: a robot that is not there, or has other joints than the plant's.
    """

    def __init__(
        self, settings: FlightSettings, given: str | Robot, of_plant: str | Robot | None = None
    ) -> None:
        """Read them.

        Args:
            settings: they name the robots.
            given: by the flight's options.
            of_plant: what the plant is, whatever its settings say.
        """
        self._given = {} if isinstance(given, str) else {robot_setting(given): given}
        self._sources: dict[str, RobotSource] = {}
        self._of_plant = settings.plant.robot if of_plant is None else of_plant
        self._of_controller = settings.controller.robot
        self.plant, self.controller, mission = (
            self._robot(robot)
            for robot in (self._of_plant, self._of_controller, settings.mission.robot)
        )
        for node, robot in (("controller", self.controller), ("mission", mission)):
            if _names(robot) != _names(self.plant):
                raise InputError(
                    f"the robots of plant and {node} must have the same joints, got "
                    f"{self.plant.name!r} with {', '.join(self.plant.all_joint_names)} and "
                    f"{robot.name!r} with {', '.join(robot.all_joint_names)}"
                )

    def _robot(self, robot: str | Robot) -> Robot:
        if isinstance(robot, Robot):
            return robot
        return self._given[robot] if robot in self._given else self._source(robot).robot

    def _source(self, name: str) -> RobotSource:
        if name not in self._sources:
            self._sources[name] = robot_source(name)
        return self._sources[name]

    def _content(self, robot: str | Robot) -> dict[str, Any]:
        """The numbers as their file has them; a robot in memory tells its own."""
        is_of_file = isinstance(robot, str) and robot not in self._given
        return self._source(str(robot)).content if is_of_file else self._robot(robot).content

    @cached_property
    def description(self) -> dict[str, Any]:
        """The numbers of the plant's robot, and of the controller's where that is another."""
        plant, controller = self._content(self._of_plant), self._content(self._of_controller)
        own = {"controller_robot": self.controller.name, "controller_robot_file": controller}
        return {"robot_file": plant, **({} if controller == plant else own)}


def _names(robot: Robot) -> tuple[tuple[str, ...], ...]:
    return robot.joint_names, robot.passive_names
