"""A captured target, rigidly attached to the body that carries the tool."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import product, rotate_tensor
from space_robot_model.robot import Robot
from space_robot_model.robot.flatten import parallel_axes
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_msgs_py.config.validation import one_of

from .target import Target

Array = NDArray[np.float64]


class Grasp(NamedTuple):
    """A target attached to a body of the robot, on the axes of that body."""

    body: int
    """Number of the body, 0 for the base."""
    mass: float
    """Mass of the target, kg."""
    com: Array
    """(3,) m, position of the target's centre of mass."""
    inertia: Array
    """(3, 3) kg m2, of the target about its centre of mass."""
    tool_axes: Array
    """(3, 3) axes of the tool that holds it, as columns."""

    @classmethod
    def of(cls, robot: Robot, target: Target) -> Grasp:
        """Place ``target`` in the tool that it names, or in the robot's first one.

        Raises:
            InputError: the robot has no such tool.
        """
        tools = {tool.name: tool for tool in robot.tools}
        tool = robot.tool
        if target.tool:
            where = f" of robot {robot.name!r} for target {target.name!r}"
            tool = tools[one_of(target.tool, tools, "tool", where)]
        axes = product(tool.rotation, target.rotation)
        return cls(
            tool.body,
            target.mass,
            tool.position + product(tool.rotation, target.place.position),
            rotate_tensor(axes, inertia_tensor(target.inertia)),
            tool.rotation,
        )

    def holding(self, robot: Robot) -> Robot:
        """Return ``robot`` with the target welded to its body."""
        body, masses = self.body, robot.mass.copy()
        coms, tensors = robot.com.copy(), robot.inertia.copy()
        masses[body] += self.mass
        coms[body] += self.mass / masses[body] * (self.com - robot.com[body])
        tensors[body] += self.inertia
        for mass, com in ((robot.mass[body], robot.com[body]), (self.mass, self.com)):
            tensors[body] += parallel_axes(mass, com - coms[body])
        return replace(robot, mass=masses, com=coms, inertia=tensors)
