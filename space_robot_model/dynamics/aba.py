"""Accelerations from forces, ``qdd = H^-1 (F - c)``, by the articulated-body algorithm.

Featherstone's recursion over a tree of bodies, linear in the number of joints. All quantities are
in inertial axes about one origin, so no frame transformations between links are needed. A spatial
inertia is stored in three blocks: ``[[J, G], [G^T, M]]``, angular part first, J and M symmetric.

A locked joint adds its link's inertia and force to those of the parent (hybrid dynamics,
Featherstone 2008, chapter 9), which is faster than a free joint. Wheels are leaves on the base,
rotors of geared joints leaves on the joints' parents.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import all_lanes, any_lane, uniform, where, whole

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
from .branches import accumulate, collect_children, keep_motion, kept_motion
from .model import Data, Model
from .rotors import take_rotor, turn_rotor
from .wheels import take_wheels, turn_wheels

Array = NDArray[np.float64]


@kernel
def aba(
    model: Model,
    omega_inertial: Array,
    joint_velocities: Array,
    force: Array,
    data: Data,
    out: Array,
) -> None:
    """Write the acceleration ``[v0dot, w0dot, thetadd]`` (N+6,) into ``out``.

    Call it after `forward_kinematics` and `spatial_velocities`. ``force`` (N+6,) is
    ``[f0, tau0, tau]``, the base's part in inertial axes, N and N m. Joints locked in ``data`` do
    not accelerate; the required torque is in ``data.holding``. Wheels, then rotors of geared
    joints, come after the joints in velocities, force and ``out``.
    """
    # inwards: the articulated-body inertia and bias force of each link, free about its joint
    inertia = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    coupling = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    mass = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    bias_moment, bias_force = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for j in range(whole(model.joint_count) - 1, -1, -1):
        i = j + 1
        if uniform(model.branches[i]) != 0.0:
            inertia, coupling, mass, bias_moment, bias_force = collect_children(
                data.inwards[i], inertia, coupling, mass, bias_moment, bias_force
            )
        inertia = add_symmetric(inertia, symmetric(data.inertia[i]))
        coupling = skew_added(coupling, vector(data.first_moment[i], 0))
        m = model.mass[i]
        mass = (mass[0] + m, mass[1] + m, mass[2] + m, mass[3], mass[4], mass[5])
        bias_moment = add(bias_moment, vector(data.bias[i], 0))
        bias_force = add(bias_force, vector(data.bias[i], 3))
        angular, linear = vector(data.motion[i], 0), vector(data.motion[i], 3)
        # U = I^A S, D = S^T U, u = tau - S^T p^A
        U_angular = add(transform_symmetric(inertia, angular), transform(coupling, linear))
        U_linear = add(transform_transposed(coupling, angular), transform_symmetric(mass, linear))
        u = force[6 + j] - dot(angular, bias_moment) - dot(linear, bias_force)
        inverse = 1.0 / (dot(angular, U_angular) + dot(linear, U_linear))
        is_locked = data.locked[j] != 0.0
        inverse = where(is_locked, 1.0, inverse)  # not divided by D, as `holding` needs
        u_over_d = u * inverse
        U_over_D_angular, U_over_D_linear = scale(U_angular, inverse), scale(U_linear, inverse)
        store(U_over_D_angular, data.U_over_D[i], 0)
        store(U_over_D_linear, data.U_over_D[i], 3)
        data.u_over_d[i] = u_over_d
        # I^a = I^A - U U^T / D,  p^a = p^A + I^a c + U u / D; for a locked joint only p^A + I^A c
        if not all_lanes(is_locked):
            free = outer_subtracted(inertia, U_over_D_angular, U_angular)
            free_coupling = outer_subtracted_general(coupling, U_over_D_angular, U_linear)
            free_mass = outer_subtracted(mass, U_over_D_linear, U_linear)
            free_moment = add(bias_moment, scale(U_angular, u_over_d))
            free_force = add(bias_force, scale(U_linear, u_over_d))
            if any_lane(is_locked):
                free = where(is_locked, inertia, free)
                free_coupling = where(is_locked, coupling, free_coupling)
                free_mass = where(is_locked, mass, free_mass)
                free_moment = where(is_locked, bias_moment, free_moment)
                free_force = where(is_locked, bias_force, free_force)
            inertia, coupling, mass = free, free_coupling, free_mass
            bias_moment, bias_force = free_moment, free_force
        angular, linear = vector(data.coriolis[i], 0), vector(data.coriolis[i], 3)
        bias_moment = add(bias_moment, transform_symmetric(inertia, angular))
        bias_moment = add(bias_moment, transform(coupling, linear))
        bias_force = add(bias_force, transform_transposed(coupling, angular))
        bias_force = add(bias_force, transform_symmetric(mass, linear))
        if uniform(model.rotor[j]) != 0.0:
            inertia, bias_moment = take_rotor(model, j, force, data, inertia, bias_moment)
        if uniform(model.continues[j]) == 0.0:
            row = data.inwards[whole(model.parent[j])]
            accumulate(row, inertia, coupling, mass, bias_moment, bias_force)
            inertia = mass = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            coupling = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            bias_moment = bias_force = (0.0, 0.0, 0.0)
    if uniform(model.branches[0]) != 0.0:
        inertia, coupling, mass, bias_moment, bias_force = collect_children(
            data.inwards[0], inertia, coupling, mass, bias_moment, bias_force
        )
    inertia = add_symmetric(inertia, symmetric(data.inertia[0]))
    coupling = skew_added(coupling, vector(data.first_moment[0], 0))
    m = model.mass[0]
    mass = (mass[0] + m, mass[1] + m, mass[2] + m, mass[3], mass[4], mass[5])
    bias_moment = add(bias_moment, vector(data.bias[0], 0))
    bias_force = add(bias_force, vector(data.bias[0], 3))
    if uniform(model.wheel_count) > 0.0:
        inertia, bias_moment = take_wheels(
            model, omega_inertial, joint_velocities, force, data, inertia, bias_moment
        )
    # free-floating base: no joint to the ground
    angular, linear = solve_spatial(
        inertia,
        coupling,
        mass,
        subtract(vector(force, 3), bias_moment),
        subtract(vector(force, 0), bias_force),
    )
    store(linear, out, 0)
    store(angular, out, 3)
    # outwards: the accelerations
    turn_wheels(model, angular, force, data, out)
    if uniform(model.branches[0]) != 0.0:
        keep_motion(angular, linear, data.outwards[0])
    for j in range(whole(model.joint_count)):
        i = j + 1
        if uniform(model.continues[j]) == 0.0:
            angular, linear = kept_motion(data.outwards[whole(model.parent[j])])
        if uniform(model.rotor[j]) != 0.0:
            turn_rotor(model, j, angular, force, data, out)
        angular = add(angular, vector(data.coriolis[i], 0))
        linear = add(linear, vector(data.coriolis[i], 3))
        acceleration = data.u_over_d[i] - dot(vector(data.U_over_D[i], 0), angular)
        acceleration -= dot(vector(data.U_over_D[i], 3), linear)
        is_locked = data.locked[j] != 0.0
        if any_lane(is_locked):
            # u - U^T a, not divided by D
            data.holding[j] = where(is_locked, acceleration, data.holding[j])
            acceleration = where(is_locked, 0.0, acceleration)
        out[6 + j] = acceleration
        angular = add(angular, scale(vector(data.motion[i], 0), acceleration))
        linear = add(linear, scale(vector(data.motion[i], 3), acceleration))
        if uniform(model.branches[i]) != 0.0:
            keep_motion(angular, linear, data.outwards[i])


@kernel
def solve_spatial(
    inertia: Symmetric, coupling: Matrix, mass: Symmetric, moment: Vector, force: Vector
) -> tuple[Vector, Vector]:
    """Return angular and linear acceleration of a body with a spatial inertia under a wrench."""
    inverse_mass = inverse_symmetric(mass)
    g = coupling
    rows = (
        transform_symmetric(inverse_mass, (g[0], g[1], g[2])),
        transform_symmetric(inverse_mass, (g[3], g[4], g[5])),
        transform_symmetric(inverse_mass, (g[6], g[7], g[8])),
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
    coupled = (dot(rows[0], force), dot(rows[1], force), dot(rows[2], force))
    angular = transform_symmetric(inverse_symmetric(complement), subtract(moment, coupled))
    linear = transform_symmetric(inverse_mass, subtract(force, transform_transposed(g, angular)))
    return angular, linear
