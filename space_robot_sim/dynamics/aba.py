"""Accelerations from forces, ``qdd = H^-1 (F - c)``, by the articulated-body algorithm.

Featherstone's recursion, linear in the number of joints. With every quantity on inertial axes
about one origin the usual changes of frame between links vanish. A spatial inertia is held in
three blocks: ``[[J, G], [G^T, M]]``, angular part first, J and M symmetric.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .algebra import (
    Matrix,
    Symmetric,
    Vector,
    add,
    add_symmetric,
    dot,
    inverse_symmetric,
    outer_subtracted,
    outer_subtracted_general,
    scale,
    skew_added,
    store,
    subtract,
    symmetric,
    transform,
    transform_symmetric,
    transform_transposed,
    vector,
)
from .kinematics import forward_kinematics, spatial_velocities
from .model import Data, Model

Array = NDArray[np.float64]


@kernel
def forward_dynamics_into(
    model: Model, quaternion: Array, theta: Array, omega_inertial: Array, theta_rate: Array,
    force: Array, data: Data, out: Array,
) -> None:  # fmt: skip
    """Write into ``out`` (n+6,) the acceleration ``[v0dot, w0dot, thetadd]``.

    ``force`` (n+6,) is ``[f0, tau0, tau]``, the base's part on inertial axes.
    """
    forward_kinematics(model, quaternion, theta, data)
    spatial_velocities(model, omega_inertial, theta_rate, data)
    # inwards: what each link's parent feels of it, free about its joint
    inertia = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    coupling = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    mass = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    moment, linear = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(model.mass.size - 1, -1, -1):
        inertia = add_symmetric(inertia, symmetric(data.inertia[i]))
        coupling = skew_added(coupling, vector(data.first_moment[i], 0))
        m = model.mass[i]
        mass = (mass[0] + m, mass[1] + m, mass[2] + m, mass[3], mass[4], mass[5])
        moment = add(moment, vector(data.bias[i], 0))
        linear = add(linear, vector(data.bias[i], 3))
        if i == 0:
            break
        axis, arm = vector(data.motion[i], 0), vector(data.motion[i], 3)
        angular = add(transform_symmetric(inertia, axis), transform(coupling, arm))
        straight = add(transform_transposed(coupling, axis), transform_symmetric(mass, arm))
        inverse = 1.0 / (dot(axis, angular) + dot(arm, straight))
        driving = (force[5 + i] - dot(axis, moment) - dot(arm, linear)) * inverse
        share_angular, share_straight = scale(angular, inverse), scale(straight, inverse)
        store(share_angular, data.share[i], 0)
        store(share_straight, data.share[i], 3)
        data.driving[i] = driving
        inertia = outer_subtracted(inertia, share_angular, angular)
        coupling = outer_subtracted_general(coupling, share_angular, straight)
        mass = outer_subtracted(mass, share_straight, straight)
        turning, moving = vector(data.coriolis[i], 0), vector(data.coriolis[i], 3)
        moment = add(moment, scale(angular, driving))
        moment = add(moment, transform_symmetric(inertia, turning))
        moment = add(moment, transform(coupling, moving))
        linear = add(linear, scale(straight, driving))
        linear = add(linear, transform_transposed(coupling, turning))
        linear = add(linear, transform_symmetric(mass, moving))
    # the base floats: no joint to the ground
    turning, moving = solve_spatial(
        inertia, coupling, mass,
        subtract(vector(force, 3), moment), subtract(vector(force, 0), linear),
    )  # fmt: skip
    store(moving, out, 0)
    store(turning, out, 3)
    # outwards
    for i in range(1, model.mass.size):
        turning = add(turning, vector(data.coriolis[i], 0))
        moving = add(moving, vector(data.coriolis[i], 3))
        rate = data.driving[i] - dot(vector(data.share[i], 0), turning)
        rate -= dot(vector(data.share[i], 3), moving)
        out[5 + i] = rate
        turning = add(turning, scale(vector(data.motion[i], 0), rate))
        moving = add(moving, scale(vector(data.motion[i], 3), rate))


@kernel
def solve_spatial(
    inertia: Symmetric, coupling: Matrix, mass: Symmetric, moment: Vector, force: Vector
) -> tuple[Vector, Vector]:
    """Angular and linear acceleration of a body with a spatial inertia under a wrench."""
    lightness = inverse_symmetric(mass)
    g = coupling
    rows = (
        transform_symmetric(lightness, (g[0], g[1], g[2])),
        transform_symmetric(lightness, (g[3], g[4], g[5])),
        transform_symmetric(lightness, (g[6], g[7], g[8])),
    )
    # Schur complement J - G M^-1 G^T
    complement = (
        inertia[0] - dot(rows[0], (g[0], g[1], g[2])),
        inertia[1] - dot(rows[1], (g[3], g[4], g[5])),
        inertia[2] - dot(rows[2], (g[6], g[7], g[8])),
        inertia[3] - dot(rows[0], (g[3], g[4], g[5])),
        inertia[4] - dot(rows[0], (g[6], g[7], g[8])),
        inertia[5] - dot(rows[1], (g[6], g[7], g[8])),
    )
    lever = (dot(rows[0], force), dot(rows[1], force), dot(rows[2], force))
    turning = transform_symmetric(inverse_symmetric(complement), subtract(moment, lever))
    moving = transform_symmetric(lightness, subtract(force, transform_transposed(g, turning)))
    return turning, moving
