"""The nominal model in the controlled coordinates ``rho = [eps, theta]`` (22)-(26), (28).

The base floats freely (``f0 = 0``), so its translation is eliminated first: with blocks
1 = v0 and 2 = [w0, thetadot], ``H_r = H22 - H21 H11^-1 H12``, ``c_r = c2 - H21 H11^-1 c1``, which
is simple since ``H11 = M E``. Then ``H_S = J^-T H_r J^-1`` and
``c_S = J^-T (c_r - H_r J^-1 Jdot J^-1 rhodot)``, with ``F_S = J^-T F`` on the right of (25).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, nested, shaped

from .attitude import attitude_jacobian_inverse, rotate, rotate_back, rotation_matrix
from .crba import crba
from .kinematics import forward_kinematics, spatial_velocities
from .model import Data, Model
from .rnea import rnea_bias

Array = NDArray[np.float64]


class RhoSpaceModel(Record):
    """Results and scratch of `rho_space_into` for n joints."""

    inertia: Array = shaped(lambda n: (n + 3, n + 3))
    """``H_S``."""
    bias: Array = shaped(lambda n: (n + 3,))
    """``c_S``."""
    full_inertia: Array = shaped(lambda n: (n + 6, n + 6))
    """H."""
    full_bias: Array = shaped(lambda n: (n + 6,))
    """c."""
    to_force: Array = shaped(lambda n: (3, 3))
    """``J0^-T`` in inertial axes, the transpose of ``J0^-1``."""
    rotation: Array = shaped(lambda n: (3, 3))
    """Rotation from the base frame to the inertial frame."""
    vectors: Array = shaped(lambda n: (3, 3))
    """Scratch."""
    data: Data = nested(Data)


@kernel
def rho_space_into(
    model: Model,
    quaternion: Array,
    joint_positions: Array,
    omega_base: Array,
    joint_velocities: Array,
    out: RhoSpaceModel,
) -> None:
    """Write H_S and c_S of the free-floating robot into ``out.inertia`` and ``out.bias``.

    Args:
        model: the nominal robot.
        quaternion: (4,) base attitude, unit; singular at eta = 0.
        joint_positions: (n,) rad, or m for prismatic joints.
        omega_base: (3,) base angular velocity in the base frame, rad/s.
        joint_velocities: (n,) rad/s or m/s.
        out: results and scratch.
    """
    semi_floating_into(model, quaternion, joint_positions, omega_base, joint_velocities, out)
    to_rho_space(quaternion, out)


@kernel
def force_for(model: RhoSpaceModel, acceleration: Array, rest: Array, force: Array) -> None:
    """Write ``H_S acceleration + rest`` into ``force``, (m,) each; ``rest`` may be ``force``."""
    for i in range(force.size):
        force[i] = rest[i]
        for j in range(force.size):
            force[i] += model.inertia[i, j] * acceleration[j]


@kernel
def to_rho_space(quaternion: Array, out: RhoSpaceModel) -> None:
    """Convert H_r and c_r of `semi_floating_into` to H_S and c_S."""
    inertia, bias = out.inertia, out.bias
    omega, convective, moved = out.vectors[0], out.vectors[1], out.vectors[2]
    # J0 in inertial axes is the transpose of J0 in the base frame, so its J0^-T is the inverse of
    # the latter. For a unit quaternion J0dot w0 = -|w0|^2 eps / 4.
    attitude_jacobian_inverse(quaternion, out.to_force)
    squared_rate = omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]
    for k in range(3):
        convective[k] = -0.25 * squared_rate * quaternion[1 + k]
    rotate_back(out.to_force, convective, moved)
    size = bias.size
    for i in range(size):
        for k in range(3):
            bias[i] -= inertia[i, k] * moved[k]
    for j in range(size):
        for k in range(3):
            convective[k] = inertia[k, j]
        rotate(out.to_force, convective, moved)
        for k in range(3):
            inertia[k, j] = moved[k]
    for i in range(size):
        convective[:] = inertia[i, :3]
        rotate(out.to_force, convective, inertia[i, :3])
    convective[:] = bias[:3]
    rotate(out.to_force, convective, bias[:3])


@kernel
def semi_floating_into(
    model: Model,
    quaternion: Array,
    joint_positions: Array,
    omega_base: Array,
    joint_velocities: Array,
    out: RhoSpaceModel,
) -> None:
    """Write H_r and c_r into ``out.inertia`` and ``out.bias``, the base's part in inertial axes.

    The arguments are those of `rho_space_into`; no attitude is singular. ``out.vectors[0]`` becomes
    the base's angular velocity in inertial axes, rad/s.
    """
    rotation_matrix(quaternion, out.rotation)
    rotate(out.rotation, omega_base, out.vectors[0])
    forward_kinematics(model, quaternion, joint_positions, out.data)
    crba(model, out.data, out.full_inertia)
    spatial_velocities(model, out.vectors[0], joint_velocities, out.data)
    rnea_bias(model, out.data, out.full_bias)
    _eliminate_translation(out.full_inertia, out.full_bias, out.inertia, out.bias)


@kernel
def _eliminate_translation(full: Array, full_bias: Array, inertia: Array, bias: Array) -> None:
    """Compute ``H_r = H22 - H21 H12 / M``, ``c_r = c2 - H21 c1 / M``: no force on the base."""
    total_mass = full[0, 0]
    for i in range(bias.size):
        bias[i] = full_bias[3 + i]
        for k in range(3):
            bias[i] -= full[3 + i, k] * full_bias[k] / total_mass
        for j in range(bias.size):
            inertia[i, j] = full[3 + i, 3 + j]
            for k in range(3):
                inertia[i, j] -= full[3 + i, k] * full[k, 3 + j] / total_mass
