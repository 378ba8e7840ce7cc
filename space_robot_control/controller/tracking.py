"""From measured and desired motion to the coordinates ``rho = [eps, theta]`` of the laws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_sim.dynamics.attitude import attitude_jacobian, rotate, rotate_back

Array = NDArray[np.float64]


@kernel
def measured_rate(
    quaternion: Array, omega_base: Array, joint_velocities: Array, jacobian: Array, rate: Array
) -> None:
    """Write J0 into ``jacobian`` and rhodot (m,) into ``rate`` (22)."""
    attitude_jacobian(quaternion, jacobian)
    rotate(jacobian, omega_base, rate[:3])
    rate[3:] = joint_velocities


@kernel
def tracking_errors(
    quaternion: Array, joint_positions: Array, rate: Array, joints: Array, base: Array,
    jacobian: Array, error: Array, error_rate: Array, acceleration: Array,
) -> None:  # fmt: skip
    """Write e, edot and rhodd_d (m,).

    ``joints`` (3, n) holds desired position, velocity, acceleration; ``base`` (10,) the desired
    quaternion, angular velocity and acceleration in the base frame. Of the two quaternions of
    the desired attitude the one on the measured side is taken. ``jacobian`` is scratch.
    """
    dot = 0.0
    for k in range(4):
        dot += quaternion[k] * base[k]
    side = 1.0 if dot >= 0.0 else -1.0
    attitude_jacobian(base[:4], jacobian)
    rotate(jacobian, base[4:7], error_rate[:3])
    rotate(jacobian, base[7:10], acceleration[:3])
    squared_rate = base[4] * base[4] + base[5] * base[5] + base[6] * base[6]
    for k in range(3):
        error[k] = side * base[1 + k] - quaternion[1 + k]
        error_rate[k] = side * error_rate[k] - rate[k]
        acceleration[k] = side * (acceleration[k] - 0.25 * squared_rate * base[1 + k])
    for i in range(joint_positions.size):
        error[3 + i] = joints[0, i] - joint_positions[i]
        error_rate[3 + i] = joints[1, i] - rate[3 + i]
        acceleration[3 + i] = joints[2, i]


@kernel
def torque_from_force(jacobian: Array, force: Array, torque: Array) -> None:
    """``tau = J^T F_S``: torque in the base frame and on the joints from the generalised force."""
    rotate_back(jacobian, force[:3], torque[:3])
    torque[3:] = force[3:]


@kernel
def force_from_torque(jacobian_inverse: Array, torque: Array, force: Array) -> None:
    """``F_S = J^-T tau``, the inverse of `torque_from_force`."""
    rotate_back(jacobian_inverse, torque[:3], force[:3])
    force[3:] = torque[3:]
