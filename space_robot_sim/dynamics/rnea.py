"""The bias force c of ``H qdd + c = F`` by the recursive Newton-Euler algorithm, (11)-(20)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .algebra import add, cross, dot, scale, store, symmetric, transform_symmetric, vector
from .model import Data, Model

Array = NDArray[np.float64]


@kernel
def rnea_bias(model: Model, data: Data, out: Array) -> None:
    """Write ``c = f_NE(qdd = 0)`` (n+6,) into ``out``.

    Call it after `forward_kinematics` and `spatial_velocities`. The accelerations (13), (14) run
    outwards, the forces (17), (18) inwards, with the sign of the child's moment corrected; then
    (19). The base's part of c is on inertial axes, N and N m, about the base CoM.
    """
    angular = (0.0, 0.0, 0.0)
    linear = (0.0, 0.0, 0.0)
    for i in range(1, model.mass.size):
        angular = add(angular, vector(data.coriolis[i], 0))
        linear = add(linear, vector(data.coriolis[i], 3))
        first_moment = vector(data.first_moment[i], 0)
        force = add(scale(linear, model.mass[i]), cross(angular, first_moment))
        moment = add(
            transform_symmetric(symmetric(data.inertia[i]), angular), cross(first_moment, linear)
        )
        store(add(vector(data.bias[i], 0), moment), data.bias[i], 0)
        store(add(vector(data.bias[i], 3), force), data.bias[i], 3)
    moment = (0.0, 0.0, 0.0)
    force = (0.0, 0.0, 0.0)
    for i in range(model.mass.size - 1, -1, -1):
        moment = add(moment, vector(data.bias[i], 0))
        force = add(force, vector(data.bias[i], 3))
        if i > 0:
            angular, linear = vector(data.motion[i], 0), vector(data.motion[i], 3)
            out[5 + i] = dot(angular, moment) + dot(linear, force)
    store(force, out, 0)
    store(moment, out, 3)
