"""Reaction wheels of the base, as leaves of the articulated-body algorithm.

A balanced wheel with spin inertia J, axis a, and speed Omega relative to the base obeys

    J (Omegadot + a . w0dot) = u,

and the base, whose inertia I0 includes the locked wheels, obeys

    I0 w0dot + w0 x (I0 w0 + sum J Omega a) + sum J Omegadot a = tau0,

with the torque u on the wheel: motor torque minus friction. Without Omegadot the base has the
inertia ``I0 - sum J a a^T`` and the additional torque ``- sum u a - w0 x sum J Omega a``. This is
the result of `aba` for a leaf with one joint (a gyrostat: Hughes, Spacecraft Attitude Dynamics,
1986, chapter 3). A wheel at rest by friction is a locked joint.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import all_lanes, any_lane, where, whole

from .algebra import Symmetric, Vector, add, cross, dot, outer_subtracted, scale, store, vector
from .model import Data, Model

Array = NDArray[np.float64]


@kernel
def take_wheels(
    model: Model,
    omega_inertial: Array,
    velocities: Array,
    force: Array,
    data: Data,
    inertia: Symmetric,
    bias_moment: Vector,
) -> tuple[Symmetric, Vector]:
    """Return the base's articulated inertia and bias moment including its wheels.

    Args:
        model: of the robot.
        omega_inertial: (3,) angular velocity of the base in inertial axes, rad/s.
        velocities: (N+W,) of joints and wheels, rad/s.
        force: (N+6+W,) as in `aba`; the last W are the torques on the wheels, N m.
        data: with the base's ``rotation``; ``wheel_axis`` is written.
        inertia: of the base and its links about the base's CoM, kg m2.
        bias_moment: of the same, N m.
    """
    n, r = whole(model.joint_count), data.rotation
    momentum = (0.0, 0.0, 0.0)
    for k in range(whole(model.wheel_count)):
        a = vector(model.wheel_axis[k], 0)
        axis = (
            r[0, 0] * a[0] + r[0, 1] * a[1] + r[0, 2] * a[2],
            r[1, 0] * a[0] + r[1, 1] * a[1] + r[1, 2] * a[2],
            r[2, 0] * a[0] + r[2, 1] * a[1] + r[2, 2] * a[2],
        )
        store(axis, data.wheel_axis[k], 0)
        spin_inertia = model.wheel_inertia[k]
        momentum = add(momentum, scale(axis, spin_inertia * velocities[n + k]))
        is_locked = data.locked[n + k] != 0.0
        if not all_lanes(is_locked):
            free = outer_subtracted(inertia, axis, scale(axis, spin_inertia))
            inertia = where(is_locked, inertia, free)
            free_moment = add(bias_moment, scale(axis, force[6 + n + k]))
            bias_moment = where(is_locked, bias_moment, free_moment)
    return inertia, add(bias_moment, cross(vector(omega_inertial, 0), momentum))


@kernel
def turn_wheels(model: Model, angular: Vector, force: Array, data: Data, out: Array) -> None:
    """Write the wheels' accelerations, rad/s2, after those of the joints into ``out``.

    ``angular`` is the base's angular acceleration, rad/s2. The torque that holds a locked wheel,
    N m, is written into ``data.holding``.
    """
    n = whole(model.joint_count)
    for k in range(whole(model.wheel_count)):
        of_base = dot(vector(data.wheel_axis[k], 0), angular)
        is_locked = data.locked[n + k] != 0.0
        free = force[6 + n + k] / model.wheel_inertia[k] - of_base
        out[6 + n + k] = where(is_locked, 0.0, free)
        if any_lane(is_locked):
            holding = force[6 + n + k] - model.wheel_inertia[k] * of_base
            data.holding[n + k] = where(is_locked, holding, data.holding[n + k])
