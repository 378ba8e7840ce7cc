"""Accelerations from forces, ``qdd = H^-1 (F - c)``, by the articulated-body algorithm.

Featherstone's recursion over a tree of bodies, linear in the number of joints. All quantities are
in inertial axes about one origin, so no frame transformations between links are needed. A spatial
inertia is stored in three blocks: ``[[J, G], [G^T, M]]``, angular part first, J and M symmetric.

A locked joint adds its link's inertia and force to those of the parent (hybrid dynamics,
Featherstone 2008, chapter 9), which is faster than a free joint.

Reaction wheels are leaves on the base, rotors of motors behind gears leaves on their joints'
parents. With spin inertia J about its axis a, a balanced leaf that turns with Omega relative to
the body that carries it obeys

    J (Omegadot + a . wdot) = u,

with the torque u on it: motor torque less friction. The body's inertia I includes the locked leaf.
Without Omegadot the body has the inertia ``I - J a a^T`` and the additional moment
``- u a - w x J Omega a`` in its balance (a gyrostat: Hughes, Spacecraft Attitude Dynamics, 1986,
chapter 3). A wheel at rest by friction is a locked leaf.

A rotor's motion is seen through the gear of ratio N: with the motor angle theta_m and the torque f
(motor less gear and friction) Omega is ``N thetadot_m`` and u ``f / N``. Spong (J. Dyn. Sys. Meas.
Control 109, 1987) leaves out ``a . wdot``; without it the momentum of the whole would not be
conserved (De Luca & Book, Robots with Flexible Elements, Springer Handbook of Robotics, 2016,
section 11.1). The torque of the gear, ``K (theta_m - theta) + D (thetadot_m - thetadot)``, acts on
the joint.
"""

from __future__ import annotations

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import all_lanes, any_lane, uniform, where, whole

from ..elementary.matrices import Array
from .algebra import (
    Matrix,
    Symmetric,
    Vector,
    accumulate_wrench,
    add,
    add_symmetric,
    collect_wrench,
    cross,
    dot,
    inverse_symmetric,
    load_motion,
    outer_subtracted,
    outer_subtracted_general,
    scale,
    skew_added,
    store,
    store_motion,
    subtract,
    symmetric,
    transform,
    transform_symmetric,
    transform_transposed,
    vector,
)
from .kinematics import joint_axis, rotor_row
from .model import Data, Model

Articulated = tuple[Symmetric, Matrix, Symmetric, Vector, Vector]
"""J, G and M of an articulated inertia, moment and force of its bias force."""


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
    not accelerate; the required torque is in ``data.holding``, that of a locked rotor seen through
    its gear. Wheels, then rotors of geared joints, come after the joints in velocities, force and
    ``out``.
    """
    # inwards: the articulated-body inertia and bias force of each link, free about its joint
    inertia = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    coupling = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    mass = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    bias_moment, bias_force = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for j in range(whole(model.joint_count) - 1, -1, -1):
        i = j + 1
        inertia, coupling, mass, bias_moment, bias_force = _add_body(
            model, i, data, inertia, coupling, mass, bias_moment, bias_force
        )
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
            # after the projection on the joint: the rotor is a leaf on the parent, not on this link
            inertia, bias_moment = _take_rotor(model, j, force, data, inertia, bias_moment)
        if uniform(model.continues[j]) == 0.0:
            # the branch begins here: its sums wait in the row of the body that carries it
            row = data.inwards[whole(model.parent[j])]
            for k in range(6):
                row[k] += inertia[k]
                row[15 + k] += mass[k]
            for k in range(9):
                row[6 + k] += coupling[k]
            accumulate_wrench(row[21:], bias_moment, bias_force)
            inertia = mass = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            coupling = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            bias_moment = bias_force = (0.0, 0.0, 0.0)
    inertia, coupling, mass, bias_moment, bias_force = _add_body(
        model, 0, data, inertia, coupling, mass, bias_moment, bias_force
    )
    if uniform(model.wheel_count) > 0.0:
        inertia, bias_moment = _take_wheels(
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
    _turn_wheels(model, angular, force, data, out)
    if uniform(model.branches[0]) != 0.0:
        store_motion(angular, linear, data.outwards[0])
    for j in range(whole(model.joint_count)):
        i = j + 1
        if uniform(model.continues[j]) == 0.0:
            angular, linear = load_motion(data.outwards[whole(model.parent[j])])
        if uniform(model.rotor[j]) != 0.0:
            _turn_rotor(model, j, angular, force, data, out)
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
            store_motion(angular, linear, data.outwards[i])


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


@subroutine
def _add_body(
    model: Model,
    i: int,
    data: Data,
    inertia: Symmetric,
    coupling: Matrix,
    mass: Symmetric,
    moment: Vector,
    force: Vector,
) -> Articulated:
    if uniform(model.branches[i]) != 0.0:
        row, c = data.inwards[i], coupling
        inertia = add_symmetric(inertia, symmetric(row))
        mass = add_symmetric(mass, symmetric(row[15:]))
        coupling = (
            c[0] + row[6],
            c[1] + row[7],
            c[2] + row[8],
            c[3] + row[9],
            c[4] + row[10],
            c[5] + row[11],
            c[6] + row[12],
            c[7] + row[13],
            c[8] + row[14],
        )
        moment, force = collect_wrench(row[21:], moment, force)
        for k in range(21):
            row[k] = 0.0
    inertia = add_symmetric(inertia, symmetric(data.inertia[i]))
    coupling = skew_added(coupling, vector(data.first_moment[i], 0))
    # M of a rigid body is m E
    m = model.mass[i]
    mass = (mass[0] + m, mass[1] + m, mass[2] + m, mass[3], mass[4], mass[5])
    moment = add(moment, vector(data.bias[i], 0))
    force = add(force, vector(data.bias[i], 3))
    return inertia, coupling, mass, moment, force


@subroutine
def _take_leaf(
    inertia: Symmetric, moment: Vector, axis: Vector, spin: float, torque: float, is_locked: bool
) -> tuple[Symmetric, Vector]:
    # I - J a a^T; the moment -u a is on the right of the balance, so u a on the left
    if not all_lanes(is_locked):
        free = outer_subtracted(inertia, axis, scale(axis, spin))
        inertia = where(is_locked, inertia, free)
        free_moment = add(moment, scale(axis, torque))
        moment = where(is_locked, moment, free_moment)
    return inertia, moment


@kernel
def _take_wheels(
    model: Model,
    omega_inertial: Array,
    velocities: Array,
    force: Array,
    data: Data,
    inertia: Symmetric,
    bias_moment: Vector,
) -> tuple[Symmetric, Vector]:
    n, r = whole(model.joint_count), data.rotation
    momentum = (0.0, 0.0, 0.0)
    for k in range(whole(model.wheel_count)):
        a, spin_inertia = vector(model.wheel_axis[k], 0), model.wheel_inertia[k]
        axis = (dot(vector(r[0], 0), a), dot(vector(r[1], 0), a), dot(vector(r[2], 0), a))
        store(axis, data.wheel_axis[k], 0)
        momentum = add(momentum, scale(axis, spin_inertia * velocities[n + k]))
        is_locked = data.locked[n + k] != 0.0
        inertia, bias_moment = _take_leaf(
            inertia, bias_moment, axis, spin_inertia, force[6 + n + k], is_locked
        )
    # w x h of all wheels together
    return inertia, add(bias_moment, cross(vector(omega_inertial, 0), momentum))


@kernel
def _turn_wheels(model: Model, angular: Vector, force: Array, data: Data, out: Array) -> None:
    n = whole(model.joint_count)
    for k in range(whole(model.wheel_count)):
        of_base = dot(vector(data.wheel_axis[k], 0), angular)
        is_locked = data.locked[n + k] != 0.0
        # Omegadot = u / J - a . wdot
        free = force[6 + n + k] / model.wheel_inertia[k] - of_base
        out[6 + n + k] = where(is_locked, 0.0, free)
        if any_lane(is_locked):
            holding = force[6 + n + k] - model.wheel_inertia[k] * of_base
            data.holding[n + k] = where(is_locked, holding, data.holding[n + k])


@subroutine
def _take_rotor(
    model: Model, j: int, force: Array, data: Data, inertia: Symmetric, bias_moment: Vector
) -> tuple[Symmetric, Vector]:
    axis, row = joint_axis(model, j, data), rotor_row(model, j)
    torque, is_locked = force[6 + row] / model.gear_ratio[j], data.locked[row] != 0.0
    return _take_leaf(inertia, bias_moment, axis, model.rotor_inertia[j], torque, is_locked)


@subroutine
def _turn_rotor(
    model: Model, j: int, angular: Vector, force: Array, data: Data, out: Array
) -> None:
    row, ratio = rotor_row(model, j), model.gear_ratio[j]
    # N^2 J thetadd_m + N J a . wdot = f
    coupled = model.rotor_inertia[j] * ratio * dot(joint_axis(model, j, data), angular)
    torque = force[6 + row] - coupled
    is_locked = data.locked[row] != 0.0
    out[6 + row] = where(is_locked, 0.0, torque / (model.rotor_inertia[j] * ratio * ratio))
    if any_lane(is_locked):
        data.holding[row] = where(is_locked, torque, data.holding[row])
