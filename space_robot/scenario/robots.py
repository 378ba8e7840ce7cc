"""The robots of a flight: the true robot, and the robot assumed by the controller."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from space_robot_model.robot import Robot
from space_robot_model.robot.find import robot_source
from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.errors import InputError

from .node_settings import FlightSettings
from .objects import robot_setting

RobotAndFile = tuple[Robot, Tree | None]
"""A robot, and the content of its file; None: of a robot in memory, whose own numbers count."""


@dataclass(frozen=True)
class Robots:
    """The robots of plant and controller, which have the same joints."""

    true: RobotAndFile
    assumed: RobotAndFile

    @classmethod
    def read(cls, settings: FlightSettings, robot: Any, plant_robot: Any = None) -> Robots:
        """Read the robots.

        Args:
            settings: of the nodes, which name the robots.
            robot: option of the flight.
            plant_robot: option of the flight; the plant's robot, overriding its settings.

        Raises:
            InputError: a robot does not exist, or its joints differ from the plant's.
        """
        sources = {} if isinstance(robot, str) else {robot_setting(robot): _source(robot)}
        for node in (settings.plant, settings.controller, settings.mission):
            if node.robot not in sources and (node is not settings.plant or plant_robot is None):
                sources[node.robot] = _source(node.robot)
        plant = sources[settings.plant.robot] if plant_robot is None else _source(plant_robot)
        true, controller = plant[0], sources[settings.controller.robot]
        for node in (settings.controller, settings.mission):
            other = sources[node.robot][0]
            if (other.joint_names, other.passive_names) != (true.joint_names, true.passive_names):
                raise InputError(
                    f"the robots of plant and {node.node} must have the same joints, got "
                    f"{true.name!r} with {', '.join(true.all_joint_names)} and "
                    f"{other.name!r} with {', '.join(other.all_joint_names)}"
                )
        return cls(plant, controller)

    def with_plant(self, robot: Robot) -> Robots:
        """Return the same robots but for the plant's, which has the same joints."""
        return replace(self, true=(robot, None))

    @property
    def plant(self) -> Robot:
        """The true robot."""
        return self.true[0]

    @property
    def controller(self) -> Robot:
        """The robot assumed by the flight software."""
        return self.assumed[0]

    @cached_property
    def options(self) -> dict[str, Tree]:
        """The robots' numbers as options of a flight; the plant's if it differs."""
        plant, controller = (
            robot.content if content is None else content
            for robot, content in (self.true, self.assumed)
        )
        return {"robot": controller, **({} if controller == plant else {"plant_robot": plant})}

    @property
    def description(self) -> dict[str, Any]:
        """Numbers of the plant's robot, and of the controller's if it differs."""
        assumed = self.options["robot"]
        if "plant_robot" not in self.options:
            return {"robot_file": assumed}
        return {
            "robot_file": self.options["plant_robot"],
            "controller_robot": self.controller.name,
            "controller_robot_file": assumed,
        }


def _source(robot: str | Robot | Tree) -> RobotAndFile:
    if isinstance(robot, str):
        file = robot_source(robot)
        return file.robot, file.content
    return (robot, None) if isinstance(robot, Robot) else (Robot.from_dict(robot), robot)
