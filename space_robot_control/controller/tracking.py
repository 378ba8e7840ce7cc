"""Tracking errors in the coordinates ``rho = [eps, theta]`` of the laws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import attitude_jacobian, rotate, rotate_back
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where
from space_robot_msgs_py.samples import Reference, State

from ..laws import Signals

Array = NDArray[np.float64]


@kernel
def measured_rate(state: State, quaternion: Array, jacobian: Array, rate: Array) -> None:
    """Write J0 into ``jacobian`` and rhodot (m,) into ``rate`` (22).

    ``quaternion`` is the state's or its negative, here and below.
    """
    attitude_jacobian(quaternion, jacobian)
    rotate(jacobian, state.omega_base, rate[:3])
    rate[3:] = state.joint_velocities


@kernel
def tracking_errors(
    state: State,
    quaternion: Array,
    rate: Array,
    reference: Reference,
    jacobian: Array,
    signals: Signals,
) -> None:
    """Write e, edot and rhodd_d into ``signals``.

    Of the two quaternions of the desired attitude the one on the measured side is taken.
    ``jacobian`` is scratch.
    """
    error, error_rate = signals.error, signals.error_rate
    acceleration, desired, omega = (
        signals.acceleration_desired,
        reference.quaternion,
        reference.omega_base,
    )
    dot = 0.0
    for k in range(4):
        dot += quaternion[k] * desired[k]
    side = where(dot >= 0.0, 1.0, -1.0)
    attitude_jacobian(desired, jacobian)
    rotate(jacobian, omega, error_rate[:3])
    rotate(jacobian, reference.alpha_base, acceleration[:3])
    squared_rate = omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]
    for k in range(3):
        error[k] = side * desired[1 + k] - quaternion[1 + k]
        error_rate[k] = side * error_rate[k] - rate[k]
        acceleration[k] = side * (acceleration[k] - 0.25 * squared_rate * desired[1 + k])
    for i in range(state.joint_positions.size):
        error[3 + i] = reference.joint_positions[i] - state.joint_positions[i]
        error_rate[3 + i] = reference.joint_velocities[i] - rate[3 + i]
        acceleration[3 + i] = reference.joint_accelerations[i]


@kernel
def show_state(state: State, quaternion: Array, reference: Reference, signals: Signals) -> None:
    """Write attitude, rates, joints and their reference into ``signals``."""
    desired = signals.reference
    for k in range(4):
        signals.quaternion[k] = quaternion[k]
        desired.quaternion[k] = reference.quaternion[k]
    for k in range(3):
        signals.omega_base[k] = state.omega_base[k]
        desired.omega_base[k] = reference.omega_base[k]
        desired.alpha_base[k] = reference.alpha_base[k]
        signals.rho[k] = quaternion[1 + k]
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
