"""Momentum and energy of robot and wheels, from a state: what a flight must conserve.

Of a robot with passive joints kinetic and spring energy together are kept, but for what the dampers
take.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import rotation_matrix
from space_robot_model.hardware.wheels import WheelSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import mass_matrix
from space_robot_msgs_py.samples import RobotState

Array = NDArray[np.float64]
NO_WHEELS = WheelSettings()


def all_positions(robot: Robot, state: RobotState) -> Array:
    """Return the positions (N,) of all joints, those without motors behind; rad or m."""
    passive = state.passive_positions[: len(robot.passive_names)]
    return np.concatenate([state.joint_positions, passive])


def generalised_velocity(robot: Robot, state: RobotState) -> Array:
    """Return ``[v0, w0, thetadot]`` (N+6,) m/s and rad/s, base part on inertial axes."""
    rotation = np.empty((3, 3))
    rotation_matrix(state.quaternion, rotation)
    passive = state.passive_velocities[: len(robot.passive_names)]
    return np.concatenate(
        [state.base_velocity, rotation @ state.omega_base, state.joint_velocities, passive]
    )


def momentum(
    robot: Robot, state: RobotState, wheels: WheelSettings = NO_WHEELS
) -> tuple[Array, Array]:
    """Return linear (N s) and angular momentum (N m s) about the inertial origin, inertial axes."""
    inertia = mass_matrix(robot, state.quaternion, all_positions(robot, state))
    base = inertia[:6] @ generalised_velocity(robot, state)
    angular = base[3:] + np.cross(state.base_position, base[:3])
    rotation = np.empty((3, 3))
    rotation_matrix(state.quaternion, rotation)
    return base[:3], angular + rotation @ wheels.unit_axes.T @ _spin_momenta(wheels, state)


def kinetic_energy(robot: Robot, state: RobotState, wheels: WheelSettings = NO_WHEELS) -> float:
    """Return the kinetic energy T of (4) and of the wheels' spin, J."""
    velocity = generalised_velocity(robot, state)
    inertia = mass_matrix(robot, state.quaternion, all_positions(robot, state))
    of_base, of_wheels = wheels.unit_axes @ state.omega_base, state.wheel_velocities[: wheels.count]
    spin = _spin_momenta(wheels, state) @ (of_base + 0.5 * of_wheels)
    return float(0.5 * velocity @ inertia @ velocity + spin)


def spring_energy(robot: Robot, state: RobotState) -> float:
    """Return the energy that the springs of the passive joints hold, J."""
    stretched = state.passive_positions[: len(robot.springs)] - [s.rest for s in robot.springs]
    return float(0.5 * np.array([s.stiffness for s in robot.springs]) @ stretched**2)


def damping_loss(robot: Robot, state: RobotState) -> float:
    """Return the power that the dampers of the passive joints take, W."""
    velocities = state.passive_velocities[: len(robot.springs)]
    return float(np.array([s.damping for s in robot.springs]) @ velocities**2)


def _spin_momenta(wheels: WheelSettings, state: RobotState) -> Array:
    return wheels.spin_momenta(state.wheel_velocities[: wheels.count])
