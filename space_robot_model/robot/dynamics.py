"""Inertia matrix, bias force, accelerations and torques of a `Robot`, as new arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from space_robot_msgs_py.compiled.lanes import WIDTH

from ..dynamics.aba import aba
from ..dynamics.crba import crba
from ..dynamics.kinematics import forward_kinematics, spatial_velocities
from ..dynamics.model import Data
from ..dynamics.rho_space import RhoSpaceModel, free_inverse_dynamics_along
from ..dynamics.rnea import AlongScratch, inverse_dynamics_along, rnea_bias
from ..elementary.matrices import Array
from .kinematics import check_robot, unit_quaternion, vector

if TYPE_CHECKING:
    from space_robot_msgs_py.compiled.records import Block

    from .robot import Robot


def generalised_rows(robot: Robot) -> list[int]:
    """Return the index in the algorithms of each of ``[v0, w0, joints]``, see `Model.row`."""
    return [*range(6), *(6 + row for row in robot.model_rows)]


def _data_at(robot: Robot, quaternion_wxyz: ArrayLike, joint_positions: ArrayLike) -> Data:
    check_robot(robot)
    data = Data.allocate(robot.joint_count)
    positions = vector(joint_positions, robot.joint_count, "joint_positions")[list(robot.order)]
    forward_kinematics(robot.model, unit_quaternion(quaternion_wxyz), positions, data)
    return data


def mass_matrix(robot: Robot, quaternion_wxyz: ArrayLike, joint_positions: ArrayLike) -> Array:
    """Return the inertia matrix H of (7)-(10).

    Args:
        robot: with N joints.
        quaternion_wxyz: (4,) base attitude, unit.
        joint_positions: (N,) of all joints, rad, or m for prismatic ones.

    Returns:
        (N+6, N+6), symmetric positive definite; generalised velocity ``[v0, w0, thetadot]``,
        base part on inertial axes.

    Raises:
        InputError: an argument has a wrong type or shape, or the quaternion is not unit.
    """
    data = _data_at(robot, quaternion_wxyz, joint_positions)
    rows = generalised_rows(robot)
    out = np.empty((len(rows), len(rows)))
    crba(robot.model, data, out)
    return out[np.ix_(rows, rows)]


def bias_force(
    robot: Robot,
    quaternion_wxyz: ArrayLike,
    joint_positions: ArrayLike,
    w0_inertial: ArrayLike,
    joint_velocities: ArrayLike,
) -> Array:
    """Return the velocity-dependent force c of (20): ``H qdd + c = F``.

    Args: see `forward_dynamics`.

    Returns:
        (N+6,) force (N), moment about the base CoM (N m) on inertial axes, joint torques (N m).

    Raises:
        InputError: an argument has a wrong type or shape, or the quaternion is not unit.
    """
    data = _data_at(robot, quaternion_wxyz, joint_positions)
    n, rows = robot.joint_count, generalised_rows(robot)
    velocities = vector(joint_velocities, n, "joint_velocities")[list(robot.order)]
    spatial_velocities(robot.model, vector(w0_inertial, 3, "w0_inertial"), velocities, data)
    out = np.empty(n + 6)
    rnea_bias(robot.model, data, out)
    return out[rows]


def forward_dynamics(
    robot: Robot,
    quaternion_wxyz: ArrayLike,
    joint_positions: ArrayLike,
    w0_inertial: ArrayLike,
    joint_velocities: ArrayLike,
    force: ArrayLike,
) -> Array:
    """Return the acceleration ``qdd = H^-1 (F - c)`` of (7).

    Args:
        robot: with N joints.
        quaternion_wxyz: (4,) base attitude, unit.
        joint_positions: (N,) of all joints, rad, or m for prismatic ones.
        w0_inertial: (3,) base angular velocity in inertial axes, rad/s.
        joint_velocities: (N,) of all joints, rad/s or m/s.
        force: (N+6,) F: force (N), moment about the base CoM (N m) on inertial axes, joint
            torques (N m).

    Returns:
        (N+6,) m/s2 and rad/s2, base part on inertial axes.

    Raises:
        InputError: an argument has a wrong type or shape, or the quaternion is not unit.
    """
    data = _data_at(robot, quaternion_wxyz, joint_positions)
    n, order = robot.joint_count, list(robot.order)
    velocities = vector(joint_velocities, n, "joint_velocities")[order]
    omega = vector(w0_inertial, 3, "w0_inertial")
    forces = vector(force, n + 6, "force")[[*range(6), *(6 + joint for joint in order)]]
    spatial_velocities(robot.model, omega, velocities, data)
    out = np.empty(n + 6)
    aba(robot.model, omega, velocities, forces, data, out)
    return out[generalised_rows(robot)]


def inverse_dynamics(robot: Robot, references: Block) -> Array:
    """Return the torque for each desired motion of a robot without force on its base.

    Args:
        robot: with n actuated joints.
        references: (N,) block of `space_robot_msgs_py.samples.Reference`, with unit quaternions.

    Returns:
        (N, n+3) N m, in base axes, then of the joints.
    """
    n, count = robot.n, len(references)
    out, scratch = np.empty((count, n + 3)), AlongScratch.lanes(n)
    numbers: Array = references.view(np.float64).reshape(count, -1)
    of_reference = scratch.view(np.float64).reshape(-1, WIDTH)[: numbers.shape[1]]
    inverse_dynamics_along(robot.model, numbers, scratch, of_reference, out)
    return out


def free_inverse_dynamics(robot: Robot, references: Block) -> Array:
    """Return the torque for each desired motion of the joints with an unactuated base.

    Args:
        robot: with n actuated joints and zero momentum.
        references: (N,) block of `space_robot_msgs_py.samples.Reference`, with unit quaternions.

    Returns:
        (N, n+3) N m, zero in the base's axes, then of the joints.
    """
    out = np.empty((len(references), robot.n + 3))
    free_inverse_dynamics_along(robot.model, references, RhoSpaceModel.allocate(robot.n), out)
    return out
