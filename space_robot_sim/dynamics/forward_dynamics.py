"""Accelerations from forces, ``qdd = H^-1 (F - c)``, by the articulated-body algorithm.

Featherstone's recursion, linear in the number of joints. With every quantity on inertial axes
about one origin the usual changes of frame between links vanish.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import kernel
from .equations_of_motion import bias_wrenches
from .kinematics import forward_kinematics, spatial_inertias, spatial_velocities
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
    spatial_inertias(model, data)
    bias_wrenches(model, data)
    n = model.mass.size - 1
    for i in range(n, 0, -1):
        _articulate(data, i, force[5 + i])
    for k in range(6):
        data.acceleration[0, k] = force[(k + 3) % 6] - data.bias[0, k]
    solve_positive_definite(data.spatial_inertia[0], data.acceleration[0])
    for i in range(1, n + 1):
        rate = data.scalar[i, 1]
        for k in range(6):
            data.acceleration[i, k] = data.acceleration[i - 1, k] + data.coriolis[i, k]
            rate -= data.momentum[i, k] * data.acceleration[i, k]
        rate /= data.scalar[i, 0]
        out[5 + i] = rate
        for k in range(6):
            data.acceleration[i, k] += data.motion[i, k] * rate
    for k in range(6):
        out[k] = data.acceleration[0, (k + 3) % 6]


@kernel
def _articulate(data: Data, i: int, torque: float) -> None:
    """Pass link i's articulated inertia and bias, free about its joint, on to its parent."""
    inertia, axis, momentum = data.spatial_inertia[i], data.motion[i], data.momentum[i]
    bias, coriolis = data.bias[i], data.coriolis[i]
    free, driving = 0.0, torque
    for r in range(6):
        total = 0.0
        for c in range(6):
            total += inertia[r, c] * axis[c]
        momentum[r] = total
        free += axis[r] * total
        driving -= axis[r] * bias[r]
    data.scalar[i, 0] = free
    data.scalar[i, 1] = driving
    parent, parent_bias = data.spatial_inertia[i - 1], data.bias[i - 1]
    for r in range(6):
        share = momentum[r] / free
        total = bias[r] + share * driving
        for c in range(6):
            rest = inertia[r, c] - share * momentum[c]
            total += rest * coriolis[c]
            parent[r, c] += rest
        parent_bias[r] += total


@kernel
def solve_positive_definite(matrix: Array, vector: Array) -> None:
    """``vector <- matrix^-1 vector`` by Cholesky; ``matrix``'s lower half becomes its factor."""
    size = vector.size
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = np.sqrt(total) if i == j else total / matrix[j, j]
    for i in range(size):
        for k in range(i):
            vector[i] -= matrix[i, k] * vector[k]
        vector[i] /= matrix[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            vector[i] -= matrix[k, i] * vector[k]
        vector[i] /= matrix[i, i]
