"""Positions and velocities of the bodies, in inertial axes with the base CoM as origin."""

from __future__ import annotations

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, whole

from ..elementary.functions import sin_cos
from ..elementary.matrices import Array
from .algebra import (
    Matrix,
    Symmetric,
    Vector,
    add,
    combine,
    cross,
    dot,
    load_frame,
    load_motion,
    rotate_axes,
    scale,
    store,
    store_frame,
    store_motion,
    subtract,
    symmetric,
    transform,
    transform_symmetric,
    vector,
)
from .attitude import rotation_matrix
from .model import Data, Model


@kernel
def forward_kinematics(model: Model, quaternion: Array, joint_positions: Array, data: Data) -> None:
    """Compute ``data.motion, first_moment, inertia`` along every branch of the tree.

    A joint's frame at zero has ``rotation`` and ``offset`` relative to its parent; from there it
    rotates about its z axis, or moves along it. With modified Denavit-Hartenberg parameters this is
    ``T(i-1 -> i) = Rx(alpha_{i-1}) Tx(a_{i-1}) Rz(theta_i) Tz(d_i)``. ``quaternion`` (4,) is the
    base's attitude, ``joint_positions`` (N,) are in rad, or m for prismatic joints, in the order of
    ``model``.
    """
    rotation_matrix(quaternion, data.rotation)
    r = data.rotation
    axes = (r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2])
    joint = (0.0, 0.0, 0.0)
    store_frame(axes, joint, data.frame[0])
    # separate loops: a call within the long one would spill its registers
    for j in range(whole(model.joint_count)):
        data.turn[j, 1], data.turn[j, 0] = sin_cos(joint_positions[j])
    for j in range(whole(model.joint_count)):
        if uniform(model.continues[j]) == 0.0:
            axes, joint = load_frame(data.frame[whole(model.parent[j])])
        x = (axes[0], axes[3], axes[6])
        y = (axes[1], axes[4], axes[7])
        z = (axes[2], axes[5], axes[8])
        offset, motion = model.offset[j], data.motion[j + 1]
        # the fixed part of the Denavit-Hartenberg transform: Rx(alpha) Tx(a), with d along z
        x, y, z = rotate_axes(x, y, z, model.rotation[j])
        joint = add(joint, combine(x, y, z, offset[0], offset[1], offset[2]))
        if uniform(model.is_prismatic[j]) == 0.0:
            ct, st = data.turn[j, 0], data.turn[j, 1]
            x, y = add(scale(x, ct), scale(y, st)), subtract(scale(y, ct), scale(x, st))
            store(z, motion, 0)
            store(cross(joint, z), motion, 3)
        else:
            joint = add(joint, scale(z, joint_positions[j]))
            store((0.0, 0.0, 0.0), motion, 0)
            store(z, motion, 3)
        axes = (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
        store_frame(axes, joint, data.frame[j + 1])
    _place(model, data)


@subroutine
def _place(model: Model, data: Data) -> None:
    """Compute first moment and inertia of every body about the origin, from its frame."""
    for i in range(whole(model.joint_count) + 1):
        axes, joint = load_frame(data.frame[i])
        com = add(joint, transform(axes, vector(model.com[i], 0)))
        moment = scale(com, model.mass[i])
        store(moment, data.first_moment[i], 0)
        xx, yy, zz, xy, xz, yz = rotated_inertia(axes, symmetric(model.inertia[i]))
        square = dot(moment, com)
        row = data.inertia[i]  # the parallel-axis theorem
        row[0] = xx + square - moment[0] * com[0]
        row[1] = yy + square - moment[1] * com[1]
        row[2] = zz + square - moment[2] * com[2]
        row[3] = xy - moment[0] * com[1]
        row[4] = xz - moment[0] * com[2]
        row[5] = yz - moment[1] * com[2]


@subroutine
def rotated_inertia(axes: Matrix, inertia: Symmetric) -> Symmetric:
    """Return ``R I R^T``, the inertia (kg m2) in outer axes, with R = ``axes``."""
    a = (axes[0], axes[1], axes[2])
    b = (axes[3], axes[4], axes[5])
    c = (axes[6], axes[7], axes[8])
    ia = transform_symmetric(inertia, a)
    ib = transform_symmetric(inertia, b)
    ic = transform_symmetric(inertia, c)
    return dot(a, ia), dot(b, ib), dot(c, ic), dot(a, ib), dot(a, ic), dot(b, ic)


@kernel
def spatial_velocities(
    model: Model, omega_inertial: Array, joint_velocities: Array, data: Data
) -> None:
    """Compute ``data.coriolis`` and ``bias`` after `forward_kinematics`: (11), (12); (15), (16).

    Velocities are relative to an inertial frame that moves with the base CoM at this instant, so
    the base's linear velocity is zero: H and c do not depend on ``v0`` (no gravity, Galilean
    invariance). The bias is the rate of a body's momentum without acceleration. With gears,
    ``joint_velocities`` has those of wheels and rotors after the joints'.
    """
    w = vector(omega_inertial, 0)
    v = (0.0, 0.0, 0.0)
    _momentum_rate(model, 0, w, v, data)
    if uniform(model.branches[0]) != 0.0:
        store_motion(w, v, data.outwards[0])
    for j in range(whole(model.joint_count)):
        if uniform(model.continues[j]) == 0.0:
            w, v = load_motion(data.outwards[whole(model.parent[j])])
        motion, coriolis = data.motion[j + 1], data.coriolis[j + 1]
        angular = scale(vector(motion, 0), joint_velocities[j])
        linear = scale(vector(motion, 3), joint_velocities[j])
        # velocity of the parent times that of the joint: terms of (13), (14) without qdd
        store(cross(w, angular), coriolis, 0)
        store(add(cross(v, angular), cross(w, linear)), coriolis, 3)
        if uniform(model.rotor[j]) != 0.0:
            _add_rotor_momentum_rate(model, j, w, joint_velocities, data)
        # (11), (12), of the point of the body that is at the origin
        w, v = add(w, angular), add(v, linear)
        _momentum_rate(model, j + 1, w, v, data)
        if uniform(model.branches[j + 1]) != 0.0:
            store_motion(w, v, data.outwards[j + 1])


@subroutine
def _momentum_rate(model: Model, i: int, w: Vector, v: Vector, data: Data) -> None:
    moment = vector(data.first_moment[i], 0)
    # (15), (16) without acceleration, about the origin: w x p and w x h + v x p
    linear = add(scale(v, model.mass[i]), cross(w, moment))
    angular = add(transform_symmetric(symmetric(data.inertia[i]), w), cross(moment, v))
    store(add(cross(w, angular), cross(v, linear)), data.bias[i], 0)
    store(cross(w, linear), data.bias[i], 3)


@subroutine
def rotor_row(model: Model, j: int) -> int:
    """Return where the rotor of joint j stands in velocities and locked joints."""
    return whole(model.joint_count) + whole(model.wheel_count) + whole(model.rotor[j]) - 1


@subroutine
def joint_axis(model: Model, j: int, data: Data) -> Vector:
    """Return the axis of joint j, also of one that slides along it, in inertial axes."""
    return vector(data.motion[j + 1], 0 if uniform(model.is_prismatic[j]) == 0.0 else 3)


@subroutine
def _add_rotor_momentum_rate(
    model: Model, j: int, omega_parent: Vector, velocities: Array, data: Data
) -> None:
    spin = model.rotor_inertia[j] * model.gear_ratio[j] * velocities[rotor_row(model, j)]
    row = data.bias[whole(model.parent[j])]
    # the spin is carried by the parent, and turns with it
    moment = cross(omega_parent, scale(joint_axis(model, j, data), spin))
    store(add(vector(row, 0), moment), row, 0)
