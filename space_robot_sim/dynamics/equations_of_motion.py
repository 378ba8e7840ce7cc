"""``H(rho) qdd + c(rho, qdot) = F`` as the paper derives it (Section II-B).

Generalised velocity ``qdot = [v0, w0, thetadot]`` (n+6), inertial frame; order of H's and c's
rows the same. Both are written in the sums of (8)-(10) and the recursion of (11)-(20), on
inertial axes about the base CoM.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import kernel
from .kinematics import forward_kinematics, spatial_inertias, spatial_velocities
from .model import Data, Model

Array = NDArray[np.float64]


@kernel
def mass_matrix_into(model: Model, quaternion: Array, theta: Array, data: Data, out: Array) -> None:
    """Write into ``out`` (n+6, n+6) the inertia matrix H, (8)-(10).

    Composite bodies: the momentum of all bodies from link j outwards, per unit rate of joint j,
    gives H's column j; its base rows are ``J_Tw`` and ``H_wphi``, its joint rows ``H_M``.
    """
    forward_kinematics(model, quaternion, theta, data)
    spatial_inertias(model, data)
    n = model.mass.size - 1
    inertia = data.spatial_inertia
    for i in range(n, 0, -1):
        for r in range(6):
            for c in range(6):
                inertia[i - 1, r, c] += inertia[i, r, c]
    for r in range(6):
        for c in range(6):
            out[r, c] = inertia[0, (r + 3) % 6, (c + 3) % 6]  # the paper puts v0 before w0
    for j in range(1, n + 1):
        column, axis = data.momentum[j], data.motion[j]
        for r in range(6):
            total = 0.0
            for c in range(6):
                total += inertia[j, r, c] * axis[c]
            column[r] = total
        for r in range(6):
            out[(r + 3) % 6, 5 + j] = out[5 + j, (r + 3) % 6] = column[r]
        for i in range(1, j + 1):
            total = 0.0
            for r in range(6):
                total += data.motion[i, r] * column[r]
            out[5 + i, 5 + j] = out[5 + j, 5 + i] = total


@kernel
def bias_wrenches(model: Model, data: Data) -> None:
    """Fill ``data.bias`` with each body's ``v x* I v``: (15), (16) at zero spatial acceleration."""
    for i in range(model.mass.size):
        v, r, out = data.velocity[i], data.com[i], data.bias[i]
        w0, w1, w2 = v[0], v[1], v[2]
        # velocity of the CoM, then m w x v and the gyroscopic moment w x I w
        c0 = v[3] + w1 * r[2] - w2 * r[1]
        c1 = v[4] + w2 * r[0] - w0 * r[2]
        c2 = v[5] + w0 * r[1] - w1 * r[0]
        f0 = model.mass[i] * (w1 * c2 - w2 * c1)
        f1 = model.mass[i] * (w2 * c0 - w0 * c2)
        f2 = model.mass[i] * (w0 * c1 - w1 * c0)
        inertia = data.inertia[i]
        h0 = inertia[0, 0] * w0 + inertia[0, 1] * w1 + inertia[0, 2] * w2
        h1 = inertia[1, 0] * w0 + inertia[1, 1] * w1 + inertia[1, 2] * w2
        h2 = inertia[2, 0] * w0 + inertia[2, 1] * w1 + inertia[2, 2] * w2
        out[0] = w1 * h2 - w2 * h1 + r[1] * f2 - r[2] * f1
        out[1] = w2 * h0 - w0 * h2 + r[2] * f0 - r[0] * f2
        out[2] = w0 * h1 - w1 * h0 + r[0] * f1 - r[1] * f0
        out[3] = f0
        out[4] = f1
        out[5] = f2


@kernel
def bias_force_into(
    model: Model, quaternion: Array, theta: Array, omega_inertial: Array, theta_rate: Array,
    data: Data, out: Array,
) -> None:  # fmt: skip
    """Write into ``out`` (n+6,) ``c = f_NE(qdd = 0)``, (11)-(20).

    Outwards the accelerations (13), (14), inwards the forces (17), (18) with the sign of the
    child's moment corrected, then (19).
    """
    forward_kinematics(model, quaternion, theta, data)
    spatial_velocities(model, omega_inertial, theta_rate, data)
    spatial_inertias(model, data)
    bias_wrenches(model, data)
    n = model.mass.size - 1
    for k in range(6):
        data.acceleration[0, k] = 0.0
    for i in range(1, n + 1):
        for k in range(6):
            data.acceleration[i, k] = data.acceleration[i - 1, k] + data.coriolis[i, k]
        for r in range(6):
            for c in range(6):
                data.bias[i, r] += data.spatial_inertia[i, r, c] * data.acceleration[i, c]
    for i in range(n, 0, -1):
        total = 0.0
        for k in range(6):
            total += data.motion[i, k] * data.bias[i, k]
            data.bias[i - 1, k] += data.bias[i, k]
        out[5 + i] = total
    for k in range(6):
        out[(k + 3) % 6] = data.bias[0, k]
