"""Pose and Jacobians of a tool, and the coupling of momentum, in new arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from space_robot_msgs_py.config.arguments import as_numbers
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..dynamics.tool_kinematics import ToolKinematics, tool_kinematics_into
from ..elementary.matrices import Array, norm

if TYPE_CHECKING:
    from ..dynamics.model import Model
    from .parts import Tool


class ModelledRobot(Protocol):
    """What is needed of a `Robot`, which imports this module."""

    @property
    def model(self) -> Model:
        """Numbers for the algorithms."""

    @property
    def joint_count(self) -> int:
        """N."""

    @property
    def order(self) -> tuple[int, ...]:
        """Joints in the order of ``model``."""

    @property
    def model_rows(self) -> tuple[int, ...]:
        """Row in ``model`` of each joint."""

    @property
    def tools(self) -> tuple[Tool, ...]:
        """All tools, the first one first."""


def tool_state(
    robot: ModelledRobot,
    quaternion_wxyz: ArrayLike,
    joint_positions: ArrayLike,
    tool: str | None = None,
) -> ToolKinematics:
    """Return pose and Jacobians of a tool, with columns in the order of the robot's joints.

    Only the matrices from its ``data`` on keep the order of the algorithms.

    Args:
        robot: the robot's numbers.
        quaternion_wxyz: (4,) base attitude, unit.
        joint_positions: (N,) of all joints, rad, or m of prismatic ones.
        tool: name of one of ``robot.tools``; None: the first.
    """
    check_robot(robot)
    order, columns = list(robot.order), list(robot.model_rows)
    mounted, out = mounted_tool(robot, tool), ToolKinematics.allocate(robot.joint_count)
    positions = vector(joint_positions, robot.joint_count, "joint_positions")[order]
    quaternion = unit_quaternion(quaternion_wxyz)
    tool_kinematics_into(robot.model, quaternion, positions, *mounted, out)
    for matrix in (out.joints, out.held, out.free, out.turn, out.coupling):
        matrix[:] = matrix[:, columns]
    return out


class MountedTool(NamedTuple):
    """A tool as the algorithms take it, see `tool_kinematics_into`."""

    body: int
    mounting: Array
    point: Array


def mounted_tool(robot: ModelledRobot, name: str | None) -> MountedTool:
    """Return a tool of a robot; None: the first.

    Raises:
        InputError: there is no tool of that name.
    """
    tool = robot.tools[0]
    if name is not None:
        tools = {tool.name: tool for tool in robot.tools}
        if name not in tools:
            raise InputError(
                f"tool: {name!r}: choose one of {', '.join(tools)}; `tools: [...]` in robot.yaml "
                "makes a URDF's link one"
            )
        tool = tools[name]
    return MountedTool(
        robot.model_rows[tool.body - 1] + 1 if tool.body else 0,
        np.ascontiguousarray(tool.rotation),
        np.ascontiguousarray(tool.position),
    )


def vector(value: ArrayLike, size: int, name: str) -> Array:
    """Return an argument as an array (size,).

    Raises:
        InputError: it has another type or shape; names it.
    """
    array = np.ascontiguousarray(as_numbers(value, name))
    if array.shape != (size,):
        raise InputError(f"{name} must have shape ({size},), got {array.shape}")
    return array


def unit_quaternion(value: ArrayLike) -> Array:
    """Return the argument ``quaternion_wxyz`` (4,), normalised.

    Raises:
        InputError: it has another type or shape, or is not unit.
    """
    array = vector(value, 4, "quaternion_wxyz")
    length = norm(array)
    if not abs(length - 1.0) < 1e-6:
        raise InputError(f"quaternion_wxyz must have norm 1, got {length}")
    return array / length


def check_robot(robot: Any) -> None:
    """Check that an argument is a `Robot`.

    Raises:
        InputError: it is not.
    """
    if not hasattr(robot, "joint_count"):
        raise InputError(f"robot: a Robot was expected, got {short(robot)}")
