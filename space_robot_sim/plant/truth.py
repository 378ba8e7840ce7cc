"""The true state as a sample, as ideal sensors would report it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import rotate_back, rotation_matrix
from space_robot_model.dynamics.model import Model
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import whole
from space_robot_msgs_py.samples import State

Array = NDArray[np.float64]


@kernel
def write_truth(model: Model, x: Array, rotation: Array, truth: State) -> None:
    """Write the plant's state into ``truth``; the torque in there is left alone.

    Args:
        model: of the plant's robot.
        x: the state, see `space_robot_sim.plant.integrator.Stages`.
        rotation: (3, 3) scratch.
        truth: angular velocity on base axes.
    """
    n, actuated = whole(model.joint_count), truth.joint_positions.size
    truth.base_position[:] = x[:3]
    truth.quaternion[:] = x[3:7]
    truth.base_velocity[:] = x[7 + n : 10 + n]
    rotation_matrix(truth.quaternion, rotation)
    rotate_back(rotation, x[10 + n : 13 + n], truth.omega_base)
    positions, velocities = x[7 : 7 + n], x[13 + n : 13 + 2 * n]
    for i in range(actuated):
        j = whole(model.row[i])
        truth.joint_positions[i], truth.joint_velocities[i] = positions[j], velocities[j]
    for i in range(actuated, n):
        j, k = whole(model.row[i]), i - actuated
        truth.passive_positions[k], truth.passive_velocities[k] = positions[j], velocities[j]
    for k in range(whole(model.wheel_count)):
        truth.wheel_velocities[k] = x[13 + 2 * n + k]
    velocity = 13 + 2 * n + whole(model.wheel_count)
    angle = velocity + whole(model.rotor_count)
    for k in range(whole(model.rotor_count)):
        truth.motor_positions[k], truth.motor_velocities[k] = x[angle + k], x[velocity + k]
