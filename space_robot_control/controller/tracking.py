"""Tracking errors in the coordinates ``rho = [eps_e, theta]`` of the laws.

eps_e is the vector part of the rotation from the desired attitude, ``q_e = q_d* q``, so that no
flight depends on the choice of the inertial frame, and 180 degrees are singular only as an error.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import rotate, rotate_back
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.samples import Reference, State

from ..laws import Signals

Array = NDArray[np.float64]


@kernel
def relative_rate(
    omega_base: Array,
    joint_velocities: Array,
    omega_desired: Array,
    jacobian: Array,
    omega: Array,
    rate: Array,
) -> None:
    """Write rhodot (m,) of (22) into ``rate``.

    Args:
        omega_base: (3,) rad/s.
        joint_velocities: (n,) rad/s or m/s.
        omega_desired: (3,) desired angular velocity on the base's axes, rad/s.
        jacobian: (3, 3) J0 of q_e.
        omega: (3,) scratch.
        rate: result.
    """
    for k in range(3):
        omega[k] = omega_base[k] - omega_desired[k]
    rotate(jacobian, omega, rate[:3])
    rate[3:] = joint_velocities


@kernel
def tracking_errors(state: State, reference: Reference, signals: Signals) -> None:
    """Write e, edot and rhodd_d into ``signals``, which has rho and rhodot of the base."""
    error, error_rate = signals.error, signals.error_rate
    for k in range(3):
        error[k] = 0.0 - signals.rho[k]
        error_rate[k] = 0.0 - signals.rho_rate[k]
        signals.acceleration_desired[k] = 0.0
    for i in range(state.joint_positions.size):
        error[3 + i] = reference.joint_positions[i] - state.joint_positions[i]
        error_rate[3 + i] = reference.joint_velocities[i] - signals.rho_rate[3 + i]
        signals.acceleration_desired[3 + i] = reference.joint_accelerations[i]


@kernel
def show_state(state: State, reference: Reference, signals: Signals) -> None:
    """Write attitude, rates, joints and their reference into ``signals``."""
    desired = signals.reference
    for k in range(4):
        signals.quaternion[k] = state.quaternion[k]
        desired.quaternion[k] = reference.quaternion[k]
    for k in range(3):
        signals.omega_base[k] = state.omega_base[k]
        desired.omega_base[k] = reference.omega_base[k]
        desired.alpha_base[k] = reference.alpha_base[k]
        signals.rho[k] = signals.attitude_error[1 + k]
    for i in range(state.joint_positions.size):
        signals.joint_positions[i] = state.joint_positions[i]
        signals.joint_velocities[i] = state.joint_velocities[i]
        signals.rho[3 + i] = state.joint_positions[i]
        desired.joint_positions[i] = reference.joint_positions[i]
        desired.joint_velocities[i] = reference.joint_velocities[i]
        desired.joint_accelerations[i] = reference.joint_accelerations[i]


@kernel
def leave_base_out(signals: Signals) -> None:
    """Zero the base's axes in all signals of m axes."""
    for k in range(3):
        signals.error[k] = signals.error_rate[k] = signals.acceleration_desired[k] = 0.0
        signals.rho[k] = signals.rho_rate[k] = signals.applied_force[k] = 0.0


@kernel
def torque_from_force(jacobian: Array, force: Array, torque: Array) -> None:
    """Compute ``tau = J^T F_S``: base and joint torque from the generalised force.

    What ``torque`` has behind them, for actuators of the base, is left alone.
    """
    rotate_back(jacobian, force[:3], torque[:3])
    torque[3 : force.size] = force[3:]


@kernel
def force_from_torque(jacobian_inverse: Array, torque: Array, force: Array) -> None:
    """Compute ``F_S = J^-T tau``, the inverse of `torque_from_force`."""
    rotate_back(jacobian_inverse, torque[:3], force[:3])
    force[3:] = torque[3:]
