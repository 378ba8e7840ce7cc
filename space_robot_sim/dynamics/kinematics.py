"""Positions and velocities of the bodies, on inertial axes with the base CoM as origin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .algebra import (
    Matrix,
    Symmetric,
    Vector,
    add,
    cross,
    dot,
    scale,
    store,
    subtract,
    symmetric,
    transform,
    transform_symmetric,
    vector,
)
from .attitude import rotation_matrix
from .model import Data, Model

Array = NDArray[np.float64]


@kernel
def forward_kinematics(model: Model, quaternion: Array, joint_positions: Array, data: Data) -> None:
    """Fill ``data.motion, first_moment, inertia`` (modified Denavit-Hartenberg).

    ``T(i-1 -> i) = Rx(alpha_{i-1}) Tx(a_{i-1}) Rz(theta_i) Tz(d_i)``; ``quaternion`` (4,) is the
    base's attitude, ``joint_positions`` (n,) rad.
    """
    rotation_matrix(quaternion, data.rotation)
    r = data.rotation
    axes = (
        r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]
    )  # fmt: skip
    joint = (0.0, 0.0, 0.0)
    _place(model, 0, axes, joint, data)
    for i in range(1, model.mass.size):
        ca, sa = model.cos_alpha[i - 1], model.sin_alpha[i - 1]
        ct, st = np.cos(joint_positions[i - 1]), np.sin(joint_positions[i - 1])
        x = (axes[0], axes[3], axes[6])
        y = (axes[1], axes[4], axes[7])
        z = (axes[2], axes[5], axes[8])
        twisted_y = add(scale(y, ca), scale(z, sa))
        z = subtract(scale(z, ca), scale(y, sa))
        joint = add(joint, add(scale(x, model.a[i - 1]), scale(z, model.d[i - 1])))
        y = subtract(scale(twisted_y, ct), scale(x, st))
        x = add(scale(x, ct), scale(twisted_y, st))
        axes = (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
        store(z, data.motion[i], 0)
        store(cross(joint, z), data.motion[i], 3)
        _place(model, i, axes, joint, data)


@kernel
def _place(model: Model, i: int, axes: Matrix, joint: Vector, data: Data) -> None:
    """Write first moment and inertia of body i about the origin, from its axes and its joint."""
    mass = model.mass[i]
    com = add(joint, transform(axes, vector(model.com[i], 0)))
    moment = scale(com, mass)
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


@kernel
def rotated_inertia(axes: Matrix, inertia: Symmetric) -> Symmetric:
    """Return ``R I R^T``, the inertia (kg m2) on the axes that ``axes`` turns into."""
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
    """Fill ``data.coriolis`` and ``bias`` after `forward_kinematics`: (11), (12); (15), (16).

    Seen from an inertial frame that moves with the base CoM at this instant, so the base's
    linear part is zero: H and c do not depend on ``v0`` (no gravity, Galilean invariance).
    The bias is the rate of a body's momentum that its velocity alone brings about.
    """
    w = vector(omega_inertial, 0)
    v = (0.0, 0.0, 0.0)
    _momentum_rate(model, 0, w, v, data)
    for i in range(1, model.mass.size):
        velocity = joint_velocities[i - 1]
        angular = scale(vector(data.motion[i], 0), velocity)
        linear = scale(vector(data.motion[i], 3), velocity)
        # velocity of the parent times the joint's own: what (13), (14) add without qdd
        store(cross(w, angular), data.coriolis[i], 0)
        store(add(cross(v, angular), cross(w, linear)), data.coriolis[i], 3)
        w, v = add(w, angular), add(v, linear)
        _momentum_rate(model, i, w, v, data)


@kernel
def _momentum_rate(model: Model, i: int, w: Vector, v: Vector, data: Data) -> None:
    moment = vector(data.first_moment[i], 0)
    linear = add(scale(v, model.mass[i]), cross(w, moment))
    angular = add(transform_symmetric(symmetric(data.inertia[i]), w), cross(moment, v))
    store(add(cross(w, angular), cross(v, linear)), data.bias[i], 0)
    store(cross(w, linear), data.bias[i], 3)
