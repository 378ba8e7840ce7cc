"""The inertia matrix H of ``H qdd + c = F`` by the composite-rigid-body algorithm, (8)-(10).

Generalised velocity ``qdot = [v0, w0, thetadot]`` (N+6,), base part in inertial axes; the rows of H
have the same order. The sums of (8)-(10) are taken in inertial axes about the base CoM.
"""

from __future__ import annotations

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, whole

from ..elementary.matrices import Array
from .algebra import (
    Symmetric,
    Vector,
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


@kernel
def crba(model: Model, data: Data, out: Array) -> None:
    """Write the inertia matrix H (N+6, N+6) into ``out``, after `forward_kinematics`.

    The momentum of all bodies from joint j outwards, per unit of its velocity, is column j of H;
    its base rows are ``J_Tw`` and ``H_wphi``, its joint rows ``H_M``, which is zero for joints of
    different branches.
    """
    mass = 0.0
    moment = (0.0, 0.0, 0.0)
    inertia = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for r in range(out.shape[0]):
        for c in range(out.shape[1]):
            out[r, c] = 0.0
    for j in range(whole(model.joint_count) - 1, -1, -1):
        if uniform(model.branches[j + 1]) != 0.0:
            mass, moment, inertia = _collect(data.inwards[j + 1], mass, moment, inertia)
        mass += model.mass[j + 1]
        moment = add(moment, vector(data.first_moment[j + 1], 0))
        inertia = add_symmetric(inertia, symmetric(data.inertia[j + 1]))
        angular, linear = vector(data.motion[j + 1], 0), vector(data.motion[j + 1], 3)
        linear_momentum = add(scale(linear, mass), cross(angular, moment))
        angular_momentum = add(transform_symmetric(inertia, angular), cross(moment, linear))
        # momentum of the bodies beyond joint j: J_Tw and H_wphi of (10)
        column = out[6 + j]
        store(linear_momentum, column, 0)
        store(angular_momentum, column, 3)
        for r in range(6):  # the paper puts v0 before w0
            out[r, 6 + j] = column[r]
        # H_M of (8): its part along each joint between here and the base; none on other branches
        i = j + 1
        while i > 0:
            angular, linear = vector(data.motion[i], 0), vector(data.motion[i], 3)
            element = dot(angular, angular_momentum) + dot(linear, linear_momentum)
            column[5 + i] = out[5 + i, 6 + j] = element
            i = whole(model.parent[i - 1])
        if uniform(model.continues[j]) == 0.0:
            row = data.inwards[whole(model.parent[j])]
            row[0] += mass
            for k in range(3):
                row[1 + k] += moment[k]
            for k in range(6):
                row[4 + k] += inertia[k]
            mass, moment = 0.0, (0.0, 0.0, 0.0)
            inertia = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if uniform(model.branches[0]) != 0.0:
        mass, moment, inertia = _collect(data.inwards[0], mass, moment, inertia)
    mass += model.mass[0]
    moment = add(moment, vector(data.first_moment[0], 0))
    xx, yy, zz, xy, xz, yz = add_symmetric(inertia, symmetric(data.inertia[0]))
    # H_B of (9)
    for k in range(3):
        out[k, k] = mass
    out[3, 3], out[4, 4], out[5, 5] = xx, yy, zz
    out[3, 4] = out[4, 3] = xy
    out[3, 5] = out[5, 3] = xz
    out[4, 5] = out[5, 4] = yz
    # -M r_0S~: the first moment of the whole robot
    out[0, 4] = out[4, 0] = moment[2]
    out[1, 3] = out[3, 1] = -moment[2]
    out[0, 5] = out[5, 0] = -moment[1]
    out[2, 3] = out[3, 2] = moment[1]
    out[1, 5] = out[5, 1] = moment[0]
    out[2, 4] = out[4, 2] = -moment[0]


@subroutine
def _collect(
    row: Array, mass: float, moment: Vector, inertia: Symmetric
) -> tuple[float, Vector, Symmetric]:
    mass, moment = mass + row[0], add(moment, vector(row, 1))
    inertia = add_symmetric(inertia, symmetric(row[4:]))
    for k in range(10):
        row[k] = 0.0
    return mass, moment, inertia
