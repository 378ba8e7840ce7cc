"""The torque that a desired motion asks for, by the recursive Newton-Euler algorithm, (11)-(20).

The base floats freely: no force acts on it (``f0 = 0``), so its CoM accelerates as the motion of
the whole pushes it, ``v0dot = -f / M``, where f is the force that (17) asks for at ``v0dot = 0``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.samples import Reference

from .algebra import add, cross, dot, scale, store, symmetric, transform_symmetric, vector
from .attitude import rotate, rotate_back
from .kinematics import forward_kinematics, spatial_velocities
from .model import Data, Model

Array = NDArray[np.float64]
Block = NDArray[Any]


@kernel
def inverse_dynamics_along(
    model: Model, references: Block, data: Data, vectors: Array, out: Array
) -> None:
    """Write into ``out`` (N, n+3), N m, the torque each of N references asks for.

    Args:
        model: the robot.
        references: (N,) array of a `Reference` each, of unit quaternions.
        data: scratch.
        vectors: (2, 3) scratch.
        out: on the base's axes, which turn with it, then on the joints.
    """
    for k in range(references.size):
        inverse_dynamics(model, references[k], data, vectors, out[k])


@kernel
def inverse_dynamics(
    model: Model, reference: Reference, data: Data, vectors: Array, out: Array
) -> None:
    """Write the torque of one reference, see `inverse_dynamics_along`, into ``out`` (n+3,)."""
    forward_kinematics(model, reference.quaternion, reference.joint_positions, data)
    rotate(data.rotation, reference.omega_base, vectors[0])
    spatial_velocities(model, vectors[0], reference.joint_velocities, data)
    rotate(data.rotation, reference.alpha_base, vectors[1])
    angular = vector(vectors[1], 0)
    linear = (0.0, 0.0, 0.0)
    mass = 0.0
    force = (0.0, 0.0, 0.0)
    for i in range(model.mass.size):
        if i > 0:
            acceleration = reference.joint_accelerations[i - 1]
            angular = add(angular, vector(data.coriolis[i], 0))
            angular = add(angular, scale(vector(data.motion[i], 0), acceleration))
            linear = add(linear, vector(data.coriolis[i], 3))
            linear = add(linear, scale(vector(data.motion[i], 3), acceleration))
        moment = vector(data.first_moment[i], 0)
        torque = add(
            transform_symmetric(symmetric(data.inertia[i]), angular), cross(moment, linear)
        )
        push = add(scale(linear, model.mass[i]), cross(angular, moment))
        store(add(vector(data.bias[i], 0), torque), data.bias[i], 0)
        push = add(vector(data.bias[i], 3), push)
        store(push, data.bias[i], 3)
        mass, force = mass + model.mass[i], add(force, push)
    drift = scale(force, -1.0 / mass)  # v0dot
    moment = (0.0, 0.0, 0.0)
    force = (0.0, 0.0, 0.0)
    for i in range(model.mass.size - 1, -1, -1):
        moment = add(moment, vector(data.bias[i], 0))
        moment = add(moment, cross(vector(data.first_moment[i], 0), drift))
        force = add(force, add(vector(data.bias[i], 3), scale(drift, model.mass[i])))
        if i > 0:
            angular, linear = vector(data.motion[i], 0), vector(data.motion[i], 3)
            out[2 + i] = dot(angular, moment) + dot(linear, force)
    store(moment, vectors[0], 0)
    rotate_back(data.rotation, vectors[0], out[:3])
