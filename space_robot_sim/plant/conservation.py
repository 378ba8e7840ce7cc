"""Momentum and kinetic energy of the whole robot, from a state: what a flight must conserve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.samples import RobotState

from ..dynamics.attitude import rotation_matrix
from ..robot import Robot
from ..robot.dynamics import mass_matrix

Array = NDArray[np.float64]


def generalised_velocity(state: RobotState) -> Array:
    """Return ``[v0, w0, thetadot]`` (n+6,) m/s and rad/s, base part on inertial axes."""
    rotation = np.empty((3, 3))
    rotation_matrix(state.quaternion, rotation)
    return np.concatenate(
        [state.base_velocity, rotation @ state.omega_base, state.joint_velocities]
    )


def momentum(robot: Robot, state: RobotState) -> tuple[Array, Array]:
    """Return linear (N s) and angular momentum (N m s) about the inertial origin, inertial axes."""
    inertia = mass_matrix(robot, state.quaternion, state.joint_positions)
    base = inertia[:6] @ generalised_velocity(state)
    return base[:3], base[3:] + np.cross(state.base_position, base[:3])


def kinetic_energy(robot: Robot, state: RobotState) -> float:
    """Return the kinetic energy T of (4), J."""
    velocity = generalised_velocity(state)
    inertia = mass_matrix(robot, state.quaternion, state.joint_positions)
    return float(0.5 * velocity @ inertia @ velocity)
