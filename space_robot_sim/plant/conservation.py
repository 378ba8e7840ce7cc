"""Momentum and kinetic energy of robot and wheels, from a state: what a flight must conserve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.samples import RobotState

from ..actuators.wheels import WheelSettings
from ..dynamics.attitude import rotation_matrix
from ..robot import Robot
from ..robot.dynamics import mass_matrix

Array = NDArray[np.float64]
NO_WHEELS = WheelSettings()


def generalised_velocity(state: RobotState) -> Array:
    """Return ``[v0, w0, thetadot]`` (n+6,) m/s and rad/s, base part on inertial axes."""
    rotation = np.empty((3, 3))
    rotation_matrix(state.quaternion, rotation)
    return np.concatenate(
        [state.base_velocity, rotation @ state.omega_base, state.joint_velocities]
    )


def momentum(
    robot: Robot, state: RobotState, wheels: WheelSettings = NO_WHEELS
) -> tuple[Array, Array]:
    """Return linear (N s) and angular momentum (N m s) about the inertial origin, inertial axes."""
    inertia = mass_matrix(robot, state.quaternion, state.joint_positions)
    base = inertia[:6] @ generalised_velocity(state)
    angular = base[3:] + np.cross(state.base_position, base[:3])
    rotation = np.empty((3, 3))
    rotation_matrix(state.quaternion, rotation)
    return base[:3], angular + rotation @ wheels.unit_axes.T @ _spin_momenta(wheels, state)


def kinetic_energy(robot: Robot, state: RobotState, wheels: WheelSettings = NO_WHEELS) -> float:
    """Return the kinetic energy T of (4) and of the wheels' spin, J."""
    velocity = generalised_velocity(state)
    inertia = mass_matrix(robot, state.quaternion, state.joint_positions)
    of_base, of_wheels = wheels.unit_axes @ state.omega_base, state.wheel_velocities[: wheels.count]
    spin = _spin_momenta(wheels, state) @ (of_base + 0.5 * of_wheels)
    return float(0.5 * velocity @ inertia @ velocity + spin)


def _spin_momenta(wheels: WheelSettings, state: RobotState) -> Array:
    return wheels.spin_momenta(state.wheel_velocities[: wheels.count])
