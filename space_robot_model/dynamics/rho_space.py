"""The nominal model in the controlled coordinates ``rho = [eps_e, theta]`` (22)-(26), (28).

eps_e is the vector part of ``q_e = q_d* q``, the rotation from the desired frame D, which turns
with omega_d and alpha_d, to the base. The paper's base is held at the identity, so that its eps is
eps_e.

The base floats freely (``f0 = 0``), so its translation is eliminated first: with blocks
1 = v0 and 2 = [w0, thetadot], ``H_r = H22 - H21 H11^-1 H12``, ``c_r = c2 - H21 H11^-1 c1``, which
is simple since ``H11 = M E``. Then ``H_S = J^-T H_r J^-1`` and
``c_S = J^-T (c_r + H_r (b - J^-1 Jdot J^-1 rhodot))``, with ``F_S = J^-T F`` on the right of
(25). On D's axes, with ``w_e = w0 - omega_d``, the base turns with ``w0dot = J0^-1 (epsdd_e - J0dot
w_e) + b`` and ``b = alpha_d + omega_d x w_e``; b is zero on all other axes.

Where nothing turns the base either, all six of its coordinates are eliminated, the rotation in
inertial axes, so that no attitude is singular: with B = [v0, w0] and M = thetadot,
``H_f = H_MM - H_MB H_BB^-1 H_BM`` and ``c_f = c_M - H_MB H_BB^-1 c_B``, so that
``H_f thetadd + c_f = tau`` (the generalized inertia of Umetani and Yoshida 1989; Papadopoulos and
Dubowsky 1991). It holds for any momentum.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, nested, shaped

from ..elementary.matrices import Array
from .algebra import (
    Symmetric,
    add,
    dot,
    inverse_symmetric,
    scale,
    store,
    transform_symmetric,
    vector,
)
from .attitude import attitude_jacobian_inverse, rotate, rotate_back, rotation_matrix
from .crba import crba
from .kinematics import forward_kinematics, spatial_velocities
from .model import Data, Model
from .rnea import rnea_bias

Block = NDArray[Any]


class RhoSpaceModel(Record):
    """Results and scratch of `rho_space_into` for n joints."""

    inertia: Array = shaped(lambda n: (n + 3, n + 3), "``H_S``")
    bias: Array = shaped(lambda n: (n + 3,), "``c_S``")
    full_inertia: Array = shaped(lambda n: (n + 6, n + 6), "H")
    full_bias: Array = shaped(lambda n: (n + 6,), "c")
    to_force: Array = shaped(lambda n: (3, 3))
    """``J0^-T`` on the outer axes, the transpose of ``J0^-1``."""
    rotation: Array = shaped(lambda n: (3, 3))
    """Rotation from the base frame to the outer one: that of the quaternion it was computed for."""
    vectors: Array = shaped(lambda n: (3, 3), "Scratch")
    data: Data = nested(Data)


@kernel
def rho_space_into(
    model: Model,
    quaternion: Array,
    joint_positions: Array,
    omega_base: Array,
    joint_velocities: Array,
    omega_desired: Array,
    alpha_desired: Array,
    out: RhoSpaceModel,
) -> None:
    """Write H_S and c_S of the free-floating robot into ``out.inertia`` and ``out.bias``.

    Args:
        model: the nominal robot.
        quaternion: (4,) q_e, unit; singular at eta = 0.
        joint_positions: (n,) rad, or m for prismatic joints.
        omega_base: (3,) base angular velocity in the base frame, rad/s.
        joint_velocities: (n,) rad/s or m/s.
        omega_desired: (3,) desired angular velocity, on the desired frame's axes, rad/s.
        alpha_desired: (3,) desired angular acceleration, on the same, rad/s2.
        out: results and scratch.
    """
    semi_floating_into(model, quaternion, joint_positions, omega_base, joint_velocities, out)
    to_rho_space(quaternion, omega_desired, alpha_desired, out)


@kernel
def force_for(model: RhoSpaceModel, acceleration: Array, rest: Array, force: Array) -> None:
    """Write ``H_S acceleration + rest`` into ``force``, (m,) each; ``rest`` may be ``force``."""
    for i in range(force.size):
        force[i] = rest[i]
        for j in range(force.size):
            force[i] += model.inertia[i, j] * acceleration[j]


@kernel
def to_rho_space(
    quaternion: Array, omega_desired: Array, alpha_desired: Array, out: RhoSpaceModel
) -> None:
    """Convert H_r and c_r of `semi_floating_into` to H_S and c_S, see `rho_space_into`."""
    inertia, bias = out.inertia, out.bias
    omega, convective, moved, d = out.vectors[0], out.vectors[1], out.vectors[2], omega_desired
    x, y, z = omega[0] - d[0], omega[1] - d[1], omega[2] - d[2]
    # J0 on the outer axes is the transpose of J0 in the base frame, so its J0^-T is the inverse of
    # the latter. For a unit quaternion J0dot w_e = -|w_e|^2 eps_e / 4.
    attitude_jacobian_inverse(quaternion, out.to_force)
    squared_rate = x * x + y * y + z * z
    for k in range(3):
        convective[k] = -0.25 * squared_rate * quaternion[1 + k]
    rotate_back(out.to_force, convective, moved)
    # b = alpha_d + omega_d x w_e
    moved[0] -= alpha_desired[0] + d[1] * z - d[2] * y
    moved[1] -= alpha_desired[1] + d[2] * x - d[0] * z
    moved[2] -= alpha_desired[2] + d[0] * y - d[1] * x
    size = bias.size
    for i in range(size):
        for k in range(3):
            bias[i] -= inertia[i, k] * moved[k]
    # H_S of (25): J^-T from the left, then J^-1 from the right
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
    """Write H_r and c_r into ``out.inertia`` and ``out.bias``, the base's part on outer axes.

    The arguments are those of `rho_space_into`; no attitude is singular. The outer axes are those
    to which the quaternion turns: nothing here depends on how they stand in the inertial frame.
    ``out.vectors[0]`` becomes the base's angular velocity on them, rad/s.
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
    # H11 = M E, so its inverse is a division
    total_mass = full[0, 0]
    for i in range(bias.size):
        bias[i] = full_bias[3 + i]
        for k in range(3):
            bias[i] -= full[3 + i, k] * full_bias[k] / total_mass
        for j in range(bias.size):
            inertia[i, j] = full[3 + i, 3 + j]
            for k in range(3):
                inertia[i, j] -= full[3 + i, k] * full[k, 3 + j] / total_mass


@kernel
def eliminate_rotation(out: RhoSpaceModel) -> None:
    """Convert H_r and c_r of `semi_floating_into` to H_f and c_f of the joints.

    The base's axes are decoupled, with inertia 1 (so that laws can invert the matrix) and zero
    bias: zero acceleration gives zero force.
    """
    inertia, bias = out.inertia, out.bias
    # H_f and c_f: the Schur complement of the base's rotation
    mobility, base_bias = _base_mobility(inertia), vector(bias, 0)
    for j in range(3, bias.size):
        turned = transform_symmetric(mobility, (inertia[0, j], inertia[1, j], inertia[2, j]))
        bias[j] -= dot(turned, base_bias)
        for i in range(3, bias.size):
            inertia[i, j] -= dot(turned, (inertia[i, 0], inertia[i, 1], inertia[i, 2]))
    for k in range(3):
        bias[k] = 0.0
        for i in range(bias.size):
            inertia[k, i] = inertia[i, k] = 0.0
        inertia[k, k] = 1.0


@subroutine
def _base_mobility(inertia: Array) -> Symmetric:
    i = inertia
    return inverse_symmetric((i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]))


@kernel
def free_inverse_dynamics_along(
    model: Model, references: Block, work: RhoSpaceModel, out: Array
) -> None:
    """Write the joint torques for each of N references into ``out`` (N, n+3), N m.

    The momentum is zero, so the base rotates with ``w0 = -H_BB^-1 H_BM thetadot``; the attitude
    does not matter.

    Args:
        model: the robot.
        references: (N,) block of `Reference`, with unit quaternions.
        work: scratch.
        out: zero in the base's axes, then the joints.
    """
    inertia, inertial, omega_base = work.inertia, work.vectors[1], work.vectors[2]
    for k in range(references.size):
        attitude, positions = references[k].quaternion, references[k].joint_positions
        rates, accelerations = references[k].joint_velocities, references[k].joint_accelerations
        # first with the base at rest, for the momentum of the joints alone
        omega_base[:] = 0.0
        semi_floating_into(model, attitude, positions, omega_base, rates, work)
        momentum = (0.0, 0.0, 0.0)
        for j in range(rates.size):
            column = (inertia[0, 3 + j], inertia[1, 3 + j], inertia[2, 3 + j])
            momentum = add(momentum, scale(column, -rates[j]))
        store(transform_symmetric(_base_mobility(inertia), momentum), inertial, 0)
        rotate_back(work.rotation, inertial, omega_base)
        semi_floating_into(model, attitude, positions, omega_base, rates, work)
        eliminate_rotation(work)
        for i in range(out.shape[1]):
            out[k, i] = work.bias[i]
            for j in range(rates.size):
                out[k, i] += inertia[i, 3 + j] * accelerations[j]
