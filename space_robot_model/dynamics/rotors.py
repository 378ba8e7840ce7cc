"""Rotors of motors behind gears, as leaves of the articulated-body algorithm.

The motor of a geared joint sits on the joint's parent p. Its rotor, with spin inertia J about the
joint's axis z, turns with ``N thetadot_m`` relative to p; theta_m is the motor angle seen through
the gear of ratio N. With f the torque on the motor's side seen through the gear (motor less gear
and friction),

    J (N thetadd_m + z . wdot_p) = f / N

and p, whose inertia I_p includes the locked rotor, has ``J N thetadd_m z + w_p x (J N thetadot_m
z)`` more in its balance of moments. Without thetadd_m it has the inertia ``I_p - J z z^T`` and the
additional moment ``- f / N z - w_p x (J N thetadot_m z)``: the result of `aba` for a leaf with one
joint, as for a reaction wheel (`.wheels`). Spong (J. Dyn. Sys. Meas. Control 109, 1987) leaves out
``z . wdot_p``; without it the momentum of the whole would not be conserved (De Luca & Book, Robots
with Flexible Elements, Springer Handbook of Robotics, 2016, section 11.1).

The torque of the gear, ``K (theta_m - theta) + D (thetadot_m - thetadot)``, acts on the joint.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import subroutine
from space_robot_msgs_py.compiled.lanes import all_lanes, any_lane, uniform, where, whole

from .algebra import Symmetric, Vector, add, cross, dot, outer_subtracted, scale, store, vector
from .model import Data, Model

Array = NDArray[np.float64]


@subroutine
def rotor_row(model: Model, j: int) -> int:
    """Return where the rotor of joint j stands in velocities and locked joints."""
    return whole(model.joint_count) + whole(model.wheel_count) + whole(model.rotor[j]) - 1


@subroutine
def joint_axis(model: Model, j: int, data: Data) -> Vector:
    """Return the axis of joint j, also of one that slides along it, in inertial axes."""
    return vector(data.motion[j + 1], 0 if uniform(model.is_prismatic[j]) == 0.0 else 3)


@subroutine
def add_rotor_momentum_rate(
    model: Model, j: int, omega_parent: Vector, velocities: Array, data: Data
) -> None:
    """Add ``w_p x (J N thetadot_m z)`` of the rotor of joint j to its parent's ``data.bias``."""
    spin = model.rotor_inertia[j] * model.gear_ratio[j] * velocities[rotor_row(model, j)]
    row = data.bias[whole(model.parent[j])]
    moment = cross(omega_parent, scale(joint_axis(model, j, data), spin))
    store(add(vector(row, 0), moment), row, 0)


@subroutine
def take_rotor(
    model: Model, j: int, force: Array, data: Data, inertia: Symmetric, bias_moment: Vector
) -> tuple[Symmetric, Vector]:
    """Return inertia and bias moment that joint j's parent gets, including the joint's rotor.

    ``force`` (N+6+W+G,) is that of `aba`; the last G are the torques on the rotors seen through
    their gears, N m.
    """
    axis, row = joint_axis(model, j, data), rotor_row(model, j)
    is_locked = data.locked[row] != 0.0
    if not all_lanes(is_locked):
        free = outer_subtracted(inertia, axis, scale(axis, model.rotor_inertia[j]))
        inertia = where(is_locked, inertia, free)
        free_moment = add(bias_moment, scale(axis, force[6 + row] / model.gear_ratio[j]))
        bias_moment = where(is_locked, bias_moment, free_moment)
    return inertia, bias_moment


@subroutine
def turn_rotor(model: Model, j: int, angular: Vector, force: Array, data: Data, out: Array) -> None:
    """Write the acceleration of joint j's rotor, seen through its gear, into ``out``.

    ``angular`` is the angular acceleration of the joint's parent, rad/s2. The torque that holds a
    locked rotor, seen through its gear, N m, is written into ``data.holding``.
    """
    row, ratio = rotor_row(model, j), model.gear_ratio[j]
    coupled = model.rotor_inertia[j] * ratio * dot(joint_axis(model, j, data), angular)
    torque = force[6 + row] - coupled
    is_locked = data.locked[row] != 0.0
    out[6 + row] = where(is_locked, 0.0, torque / (model.rotor_inertia[j] * ratio * ratio))
    if any_lane(is_locked):
        data.holding[row] = where(is_locked, torque, data.holding[row])
