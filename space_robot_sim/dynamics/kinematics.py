"""Where each body is and how it moves, on inertial axes with the base CoM as origin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..attitude import rotation_matrix
from ..compiled import kernel
from .model import Data, Model

Array = NDArray[np.float64]


@kernel
def forward_kinematics(model: Model, quaternion: Array, theta: Array, data: Data) -> None:
    """Fill ``data.rotation, joint, com, inertia, motion`` (modified Denavit-Hartenberg).

    ``T(i-1 -> i) = Rx(alpha_{i-1}) Tx(a_{i-1}) Rz(theta_i) Tz(d_i)``.
    """
    rotation_matrix(quaternion, data.rotation[0])
    rotate_inertia(data.rotation[0], model.inertia[0], data.inertia[0])
    for i in range(1, model.mass.size):
        parent, own = data.rotation[i - 1], data.rotation[i]
        ca, sa = model.twist_cos[i - 1], model.twist_sin[i - 1]
        ct, st = np.cos(theta[i - 1]), np.sin(theta[i - 1])
        for r in range(3):
            x, y, z = parent[r, 0], parent[r, 1], parent[r, 2]
            twisted_y = y * ca + z * sa
            twisted_z = z * ca - y * sa
            own[r, 0] = x * ct + twisted_y * st
            own[r, 1] = twisted_y * ct - x * st
            own[r, 2] = twisted_z
            data.motion[i, r] = twisted_z
            data.joint[i, r] = (
                data.joint[i - 1, r] + x * model.joint_x[i - 1] + twisted_z * model.joint_z[i - 1]
            )
        for r in range(3):
            data.com[i, r] = data.joint[i, r] + (
                own[r, 0] * model.com[i, 0]
                + own[r, 1] * model.com[i, 1]
                + own[r, 2] * model.com[i, 2]
            )
        rotate_inertia(own, model.inertia[i], data.inertia[i])
        p, s = data.joint[i], data.motion[i]
        s[3] = p[1] * s[2] - p[2] * s[1]
        s[4] = p[2] * s[0] - p[0] * s[2]
        s[5] = p[0] * s[1] - p[1] * s[0]


@kernel
def rotate_inertia(rotation: Array, inertia: Array, out: Array) -> None:
    """``out = R I R^T``; symmetric, so only the upper half is computed."""
    for r in range(3):
        x = (
            rotation[r, 0] * inertia[0, 0]
            + rotation[r, 1] * inertia[1, 0]
            + rotation[r, 2] * inertia[2, 0]
        )
        y = (
            rotation[r, 0] * inertia[0, 1]
            + rotation[r, 1] * inertia[1, 1]
            + rotation[r, 2] * inertia[2, 1]
        )
        z = (
            rotation[r, 0] * inertia[0, 2]
            + rotation[r, 1] * inertia[1, 2]
            + rotation[r, 2] * inertia[2, 2]
        )
        for c in range(r, 3):
            value = x * rotation[c, 0] + y * rotation[c, 1] + z * rotation[c, 2]
            out[r, c] = value
            out[c, r] = value


@kernel
def spatial_velocities(model: Model, omega_inertial: Array, theta_rate: Array, data: Data) -> None:
    """Fill ``data.velocity`` and ``coriolis`` after `forward_kinematics`.

    Seen from an inertial frame that moves with the base CoM at this instant, so the base's
    linear part is zero: H and c do not depend on ``v0`` (no gravity, Galilean invariance).
    """
    for k in range(3):
        data.velocity[0, k] = omega_inertial[k]
        data.velocity[0, 3 + k] = 0.0
    for i in range(1, model.mass.size):
        s, rate = data.motion[i], theta_rate[i - 1]
        for k in range(6):
            data.velocity[i, k] = data.velocity[i - 1, k] + s[k] * rate
        v, c = data.velocity[i], data.coriolis[i]
        c[0] = rate * (v[1] * s[2] - v[2] * s[1])
        c[1] = rate * (v[2] * s[0] - v[0] * s[2])
        c[2] = rate * (v[0] * s[1] - v[1] * s[0])
        c[3] = rate * (v[1] * s[5] - v[2] * s[4] + v[4] * s[2] - v[5] * s[1])
        c[4] = rate * (v[2] * s[3] - v[0] * s[5] + v[5] * s[0] - v[3] * s[2])
        c[5] = rate * (v[0] * s[4] - v[1] * s[3] + v[3] * s[1] - v[4] * s[0])


@kernel
def spatial_inertias(model: Model, data: Data) -> None:
    """Fill ``data.spatial_inertia`` with each body's own, at the origin.

    ``[[I_i - m r~ r~, m r~], [-m r~, m E]]`` for moments about the origin and forces.
    """
    for i in range(model.mass.size):
        m, r, out = model.mass[i], data.com[i], data.spatial_inertia[i]
        x, y, z = r[0], r[1], r[2]
        inertia = data.inertia[i]
        out[0, 0] = inertia[0, 0] + m * (y * y + z * z)
        out[1, 1] = inertia[1, 1] + m * (x * x + z * z)
        out[2, 2] = inertia[2, 2] + m * (x * x + y * y)
        out[0, 1] = out[1, 0] = inertia[0, 1] - m * x * y
        out[0, 2] = out[2, 0] = inertia[0, 2] - m * x * z
        out[1, 2] = out[2, 1] = inertia[1, 2] - m * y * z
        for k in range(3):
            out[k, 3 + k] = out[3 + k, k] = 0.0
            out[3 + k, 3 + k] = m
        out[0, 4] = out[4, 0] = -m * z
        out[0, 5] = out[5, 0] = m * y
        out[1, 3] = out[3, 1] = m * z
        out[1, 5] = out[5, 1] = -m * x
        out[2, 3] = out[3, 2] = -m * y
        out[2, 4] = out[4, 2] = m * x
        out[3, 4] = out[4, 3] = 0.0
        out[3, 5] = out[5, 3] = 0.0
        out[4, 5] = out[5, 4] = 0.0
