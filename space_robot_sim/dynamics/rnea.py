"""The bias force c of ``H qdd + c = F`` by the recursive Newton-Euler algorithm, (11)-(20)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .algebra import (
    add,
    cross,
    dot,
    scale,
    store,
    symmetric,
    transform_symmetric,
    vector,
)
from .kinematics import forward_kinematics, spatial_velocities
from .model import Data, Model

Array = NDArray[np.float64]


@kernel
def bias_force_into(
    model: Model, quaternion: Array, theta: Array, omega_inertial: Array, theta_rate: Array,
    data: Data, out: Array,
) -> None:  # fmt: skip
    """Write into ``out`` (n+6,) ``c = f_NE(qdd = 0)``, (11)-(20)."""
    forward_kinematics(model, quaternion, theta, data)
    spatial_velocities(model, omega_inertial, theta_rate, data)
    newton_euler(model, data, out)


@kernel
def newton_euler(model: Model, data: Data, out: Array) -> None:
    """C after `forward_kinematics` and `spatial_velocities`.

    Outwards the accelerations (13), (14), inwards the forces (17), (18) with the sign of the
    child's moment corrected, then (19).
    """
    turning = (0.0, 0.0, 0.0)
    moving = (0.0, 0.0, 0.0)
    for i in range(1, model.mass.size):
        turning = add(turning, vector(data.coriolis[i], 0))
        moving = add(moving, vector(data.coriolis[i], 3))
        moment = vector(data.first_moment[i], 0)
        linear = add(scale(moving, model.mass[i]), cross(turning, moment))
        angular = add(
            transform_symmetric(symmetric(data.inertia[i]), turning), cross(moment, moving)
        )
        store(add(vector(data.bias[i], 0), angular), data.bias[i], 0)
        store(add(vector(data.bias[i], 3), linear), data.bias[i], 3)
    moment = (0.0, 0.0, 0.0)
    force = (0.0, 0.0, 0.0)
    for i in range(model.mass.size - 1, -1, -1):
        moment = add(moment, vector(data.bias[i], 0))
        force = add(force, vector(data.bias[i], 3))
        if i > 0:
            axis, arm = vector(data.motion[i], 0), vector(data.motion[i], 3)
            out[5 + i] = dot(axis, moment) + dot(arm, force)
    store(force, out, 0)
    store(moment, out, 3)
