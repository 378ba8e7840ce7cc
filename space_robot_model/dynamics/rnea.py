"""The bias force c of ``H qdd + c = F`` by the recursive Newton-Euler algorithm, (11)-(20)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, whole

from .algebra import Vector, add, cross, dot, scale, store, symmetric, transform_symmetric, vector
from .branches import hand_in_wrench, keep_motion, kept_motion, taken_in_wrench
from .model import Data, Model

Array = NDArray[np.float64]


@kernel
def rnea_bias(model: Model, data: Data, out: Array) -> None:
    """Write ``c = f_NE(qdd = 0)`` (N+6,) into ``out``.

    Call it after `forward_kinematics` and `spatial_velocities`. The outward recursion computes
    accelerations (13), (14), the inward one forces (17), (18), with the sign of the child's moment
    corrected, and (19). The base's part of c is in inertial axes, N and N m, about the base CoM.
    """
    angular = (0.0, 0.0, 0.0)
    linear = (0.0, 0.0, 0.0)
    if uniform(model.branches[0]) != 0.0:
        keep_motion(angular, linear, data.outwards[0])
    for j in range(whole(model.joint_count)):
        i = j + 1
        if uniform(model.continues[j]) == 0.0:
            angular, linear = kept_motion(data.outwards[whole(model.parent[j])])
        angular = add(angular, vector(data.coriolis[i], 0))
        linear = add(linear, vector(data.coriolis[i], 3))
        force_of_body(model, i, angular, linear, data)
        if uniform(model.branches[i]) != 0.0:
            keep_motion(angular, linear, data.outwards[i])
    moment = (0.0, 0.0, 0.0)
    force = (0.0, 0.0, 0.0)
    for j in range(whole(model.joint_count) - 1, -1, -1):
        i = j + 1
        if uniform(model.branches[i]) != 0.0:
            moment, force = taken_in_wrench(data.inwards[i], moment, force)
        moment = add(moment, vector(data.bias[i], 0))
        force = add(force, vector(data.bias[i], 3))
        angular, linear = vector(data.motion[i], 0), vector(data.motion[i], 3)
        out[6 + j] = dot(angular, moment) + dot(linear, force)
        if uniform(model.continues[j]) == 0.0:
            hand_in_wrench(data.inwards[whole(model.parent[j])], moment, force)
            moment = force = (0.0, 0.0, 0.0)
    if uniform(model.branches[0]) != 0.0:
        moment, force = taken_in_wrench(data.inwards[0], moment, force)
    store(add(force, vector(data.bias[0], 3)), out, 0)
    store(add(moment, vector(data.bias[0], 0)), out, 3)


@subroutine
def force_of_body(model: Model, i: int, angular: Vector, linear: Vector, data: Data) -> None:
    """Add the inertial force of the acceleration of body i, (15), (16), to ``data.bias``."""
    first_moment = vector(data.first_moment[i], 0)
    force = add(scale(linear, model.mass[i]), cross(angular, first_moment))
    moment = add(
        transform_symmetric(symmetric(data.inertia[i]), angular), cross(first_moment, linear)
    )
    store(add(vector(data.bias[i], 0), moment), data.bias[i], 0)
    store(add(vector(data.bias[i], 3), force), data.bias[i], 3)
