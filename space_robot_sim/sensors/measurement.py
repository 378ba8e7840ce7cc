"""Sensors without error: the state as the plant's nodes tell it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.samples import State

from ..dynamics.attitude import rotate_back, rotation_matrix

Array = NDArray[np.float64]


@kernel
def measure(x: Array, rotation: Array, measured: State) -> None:
    """Write what the sensors see of the plant's state into ``measured``; not the applied torque.

    Args:
        x: (2n+13,) the state, see `space_robot_sim.plant.integrator.Stages`.
        rotation: (3, 3) scratch.
        measured: angular velocity on base axes, as a gyro measures it.
    """
    n = measured.joint_positions.size
    measured.base_position[:] = x[:3]
    measured.quaternion[:] = x[3:7]
    measured.joint_positions[:] = x[7 : 7 + n]
    measured.base_velocity[:] = x[7 + n : 10 + n]
    rotation_matrix(measured.quaternion, rotation)
    rotate_back(rotation, x[10 + n : 13 + n], measured.omega_base)
    measured.joint_velocities[:] = x[13 + n :]
