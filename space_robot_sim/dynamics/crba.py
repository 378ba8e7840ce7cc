"""The inertia matrix H of ``H qdd + c = F`` by the composite-rigid-body algorithm, (8)-(10).

Generalised velocity ``qdot = [v0, w0, thetadot]`` (n+6), base part on inertial axes; H's rows have
the same order. The sums of (8)-(10) are taken on inertial axes about the base CoM.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .algebra import (
    add,
    add_symmetric,
    cross,
    dot,
    scale,
    store,
    symmetric,
    transform_symmetric,
    vector,
)
from .model import Data, Model

Array = NDArray[np.float64]


@kernel
def crba(model: Model, data: Data, out: Array) -> None:
    """Write the inertia matrix H (n+6, n+6) into ``out``, after `forward_kinematics`.

    The momentum of all bodies from link j outwards, per unit velocity of joint j, gives column j
    of H; its base rows are ``J_Tw`` and ``H_wphi``, its joint rows ``H_M``.
    """
    mass = 0.0
    moment = (0.0, 0.0, 0.0)
    inertia = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for j in range(model.mass.size - 1, -1, -1):
        mass += model.mass[j]
        moment = add(moment, vector(data.first_moment[j], 0))
        inertia = add_symmetric(inertia, symmetric(data.inertia[j]))
        if j == 0:
            break
        angular, linear = vector(data.motion[j], 0), vector(data.motion[j], 3)
        linear_momentum = add(scale(linear, mass), cross(angular, moment))
        angular_momentum = add(transform_symmetric(inertia, angular), cross(moment, linear))
        column = out[5 + j]
        store(linear_momentum, column, 0)
        store(angular_momentum, column, 3)
        for i in range(1, j + 1):
            angular, linear = vector(data.motion[i], 0), vector(data.motion[i], 3)
            column[5 + i] = dot(angular, angular_momentum) + dot(linear, linear_momentum)
    for r in range(6):  # the paper puts v0 before w0
        for c in range(6):
            out[r, c] = 0.0
    xx, yy, zz, xy, xz, yz = inertia
    for k in range(3):
        out[k, k] = mass
    out[3, 3], out[4, 4], out[5, 5] = xx, yy, zz
    out[3, 4] = out[4, 3] = xy
    out[3, 5] = out[5, 3] = xz
    out[4, 5] = out[5, 4] = yz
    # -M r_0S~: the first moment of the whole
    out[0, 4] = out[4, 0] = moment[2]
    out[1, 3] = out[3, 1] = -moment[2]
    out[0, 5] = out[5, 0] = -moment[1]
    out[2, 3] = out[3, 2] = moment[1]
    out[1, 5] = out[5, 1] = moment[0]
    out[2, 4] = out[4, 2] = -moment[0]
    for j in range(6, out.shape[0]):
        for i in range(j):
            out[i, j] = out[j, i]
