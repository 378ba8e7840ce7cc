"""Pose and Jacobians of a tool, and the coupling of momentum, in new arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.config.arguments import as_numbers
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..dynamics.tool_kinematics import ToolKinematics, tool_kinematics_into
from ..elementary.matrices import norm

if TYPE_CHECKING:
    from ..dynamics.model import Model
    from .parts import Tool

Array = NDArray[np.float64]


class ModelledRobot(Protocol):
    """What is needed of a `Robot`."""

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


class ToolState(NamedTuple):
    """Pose and Jacobians of a tool, see `space_robot_model.dynamics.tool_kinematics`.

    A twist is ``[v; w]``, m/s and rad/s, on inertial axes; columns are the robot's N joints,
    passive ones last.
    """

    position: Array
    """(3,) m, origin of the tool from the robot's centre of mass, inertial axes."""
    centre_of_mass: Array
    """(3,) m, the robot's centre of mass from the base's frame, inertial axes."""
    rotation: Array
    """(3, 3) from the tool's frame to the inertial frame."""
    base: Array
    """(6, 6) ``J_b``: twist by ``[v0; w0]``."""
    joints: Array
    """(6, N) ``J_m``: twist by joint velocities with the base fixed."""
    attitude: Array
    """(6, 3) ``J_w``: twist by ``w0``, linear momentum zero."""
    held: Array
    """(6, N) twist by joint velocities, attitude held, linear momentum zero."""
    free: Array
    """(6, N) ``J_g``: the same, base free, both momenta zero: the generalised Jacobian."""
    turn: Array
    """(3, N) ``w0`` of a free base by joint velocities, inertial axes."""
    coupling: Array
    """(3, N) angular momentum about the centre of mass by joint velocities, attitude held."""


def tool_state(
    robot: ModelledRobot,
    quaternion_wxyz: ArrayLike,
    joint_positions: ArrayLike,
    tool: str | None = None,
) -> ToolState:
    """Return pose and Jacobians of a tool.

    Args:
        robot: the robot's numbers.
        quaternion_wxyz: (4,) base attitude, unit.
        joint_positions: (N,) of all joints, rad, or m of prismatic ones.
        tool: name of one of ``robot.tools``; None: the first.

    Raises:
        InputError: an argument has another type or shape, the quaternion is not unit, or there is
            no such tool.
    """
    check_robot(robot)
    n, order, columns = robot.joint_count, list(robot.order), list(robot.model_rows)
    mounted, out = mounted_tool(robot, tool), ToolKinematics.allocate(n)
    positions = vector(joint_positions, n, "joint_positions")[order]
    quaternion = unit_quaternion(quaternion_wxyz)
    tool_kinematics_into(robot.model, quaternion, positions, *mounted, out)
    return ToolState(
        out.position.copy(),
        out.centre_of_mass.copy(),
        out.rotation.copy(),
        out.base.copy(),
        out.joints[:, columns],
        out.attitude.copy(),
        out.held[:, columns],
        out.free[:, columns],
        out.turn[:, columns],
        out.coupling[:, columns],
    )


def manipulability(jacobian: Array) -> float:
    """Return ``sqrt(det(J J^T))`` of Yoshikawa (1985): zero in a singular posture.

    With the generalised Jacobian a posture where it is zero is a dynamic singularity.
    """
    return float(np.prod(np.linalg.svd(jacobian, compute_uv=False)))


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
