"""Nominal model of a robot with an unactuated, free-floating base.

Without force and torque on the base all six of its coordinates are eliminated: with blocks
B = [v0, w0] and M = thetadot of (7), ``H_f = H_MM - H_MB H_BB^-1 H_BM`` and
``c_f = c_M - H_MB H_BB^-1 c_B``, so that ``H_f thetadd + c_f = tau`` (the generalized inertia of
Umetani and Yoshida 1989; Papadopoulos and Dubowsky 1991). It holds for any momentum. The base's
translation is eliminated first (`.rho_space`), then its rotation, in inertial axes, so that no
attitude is singular.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine

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
from .attitude import rotate_back
from .model import Model
from .rho_space import RhoSpaceModel, semi_floating_into

Array = NDArray[np.float64]
Block = NDArray[Any]


@kernel
def free_floating_into(
    model: Model,
    quaternion: Array,
    joint_positions: Array,
    omega_base: Array,
    joint_velocities: Array,
    out: RhoSpaceModel,
) -> None:
    """Write H_f and c_f into the joints' part of ``out.inertia`` and ``out.bias``.

    The arguments are those of `rho_space_into`.
    """
    semi_floating_into(model, quaternion, joint_positions, omega_base, joint_velocities, out)
    eliminate_rotation(out)


@kernel
def eliminate_rotation(out: RhoSpaceModel) -> None:
    """Convert H_r and c_r of `semi_floating_into` to H_f and c_f of the joints.

    The base's axes are decoupled, with inertia 1 (so that laws can invert the matrix) and zero
    bias: zero acceleration gives zero force.
    """
    inertia, bias = out.inertia, out.bias
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
    """Return the inverse of the base rotation's block of H_r (m, m)."""
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
        omega_base[:] = 0.0
        semi_floating_into(model, attitude, positions, omega_base, rates, work)
        momentum = (0.0, 0.0, 0.0)
        for j in range(rates.size):
            column = (inertia[0, 3 + j], inertia[1, 3 + j], inertia[2, 3 + j])
            momentum = add(momentum, scale(column, -rates[j]))
        store(transform_symmetric(_base_mobility(inertia), momentum), inertial, 0)
        rotate_back(work.rotation, inertial, omega_base)
        free_floating_into(model, attitude, positions, omega_base, rates, work)
        for i in range(out.shape[1]):
            out[k, i] = work.bias[i]
            for j in range(rates.size):
                out[k, i] += inertia[i, 3 + j] * accelerations[j]
