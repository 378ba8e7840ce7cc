"""Compiled kernels of a tick's signals: navigation, errors, nominal model and estimate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import (
    SINGULAR_ETA,
    attitude_error_into,
    attitude_jacobian,
    attitude_jacobian_inverse,
    rotate,
    rotate_back,
    rotation_matrix,
)
from space_robot_model.dynamics.rho_space import (
    eliminate_rotation,
    semi_floating_into,
    to_rho_space,
)
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import all_lanes, uniform, where, whole
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import MOST_WHEELS, Reference, State

from ..laws.base import CONSTANT_INERTIA, NOMINAL_INERTIA
from ..navigation.navigation import navigate
from .memory import ControllerMemory
from .time_delay_estimation import follows, nominal_estimate, observe, time_delay_estimate
from .tracking import force_from_torque, leave_base_out, relative_rate, show_state, tracking_errors

Array = NDArray[np.float64]

NORM_TOLERANCE = 1e-3
"""Tolerance of the squared norm of a quaternion."""
LARGEST = 1e30
"""No number of a state or reference is larger: far beyond any flight, yet no law's products of
such numbers overflow."""

USABLE, NOT_FINITE, TOO_LARGE, NOT_UNIT, SINGULAR = range(5)
"""The status of a state."""


@kernel
def compute_signals(
    block: Block,
    tick: int,
    state: Block,
    reference: Block,
    h_bar: Array,
    estimate: int,
    uses_model: bool,
    period: float,
) -> int:
    """Compute the signals from a measured or estimated state and its reference.

    Without a base to control all of them are zero on its axes, and none asks for J0^-1.

    Args: see `controller_tick` and `LawCode`.

    Returns:
        `USABLE`, or why the state is not: then nothing was done, but that navigation may have taken
        a measured state that was usable.
    """
    status: int = compute_signals_for(
        block, tick, state, reference[0], h_bar, estimate, uses_model, period
    )
    return status


@kernel
def compute_signals_for(
    block: Block,
    tick: int,
    state: Block,
    reference: Reference,
    h_bar: Array,
    estimate: int,
    uses_model: bool,
    period: float,
) -> int:
    """Compute the signals as `compute_signals`, for a record; that of the signals may be it."""
    memory, measured = block[0], state[0]
    signals, controls_base = memory.signals, uniform(memory.controls_base) == 1.0
    is_filtered, desired = uniform(memory.navigation.is_filtered) == 1.0, reference.quaternion
    status: int = status_of(measured, desired, controls_base)
    if all_lanes(status != USABLE):
        return status
    memory.allocation.reported_speeds[:] = measured.wheel_velocities
    memory.allocation.reported_torques[:] = measured.wheel_torques
    memory.allocation.torquers.magnetic_field[:] = measured.magnetic_field
    if is_filtered:
        navigate(memory.navigation, tick, measured, period)
        measured = memory.navigation.estimate
        status = where(status == USABLE, status_of(measured, desired, controls_base), status)
        if all_lanes(status != USABLE):
            return status
    near = signals.attitude_error
    if controls_base:
        attitude_error_into(desired, measured.quaternion, near)
        attitude_jacobian(near, memory.jacobian)
        steps_of_reference(memory, tick, reference, period)
        rotation_matrix(near, memory.rotation)
        rotate_back(memory.rotation, reference.omega_base, memory.omega_desired)
        if not follows(memory.pair, tick):  # whatever J0 was, this one's is nearer
            attitude_jacobian_inverse(near, memory.last_jacobian_inverse)
        # the applied torque acted from the last tick on, so that tick's J0 turns it into F_S
        force_from_torque(
            memory.last_jacobian_inverse, measured.applied_torque, signals.applied_force
        )
    else:
        near[:] = measured.quaternion
        signals.applied_force[:] = measured.applied_torque
    relative_rate(
        measured.omega_base,
        measured.joint_velocities,
        memory.omega_desired,
        memory.jacobian,
        memory.omega,
        signals.rho_rate,
    )
    signals.tick = tick
    signals.time = tick * period
    show_state(measured, reference, signals)
    tracking_errors(measured, reference, signals)
    if not controls_base:
        leave_base_out(signals)
    observe_pair(memory, tick, state[0], estimate, period)
    if controls_base:
        attitude_jacobian_inverse(near, memory.last_jacobian_inverse)
    if uses_model:
        semi_floating_into(
            signals.model,
            near,
            measured.joint_positions,
            measured.omega_base,
            measured.joint_velocities,
            signals.nominal,
        )
        if controls_base:
            to_rho_space(near, reference.omega_base, reference.alpha_base, signals.nominal)
        else:
            eliminate_rotation(signals.nominal)
    if estimate == CONSTANT_INERTIA:
        time_delay_estimate(memory.pair, h_bar, signals.n_hat)
    elif estimate == NOMINAL_INERTIA:
        nominal_estimate(memory.pair, signals.nominal.inertia, signals.n_hat)
    return status


@kernel
def steps_of_reference(
    memory: ControllerMemory, tick: int, reference: Reference, period: float
) -> None:
    """Write the steps of rho and rhodot since the last tick that the base's reference makes.

    A reference that is held, comes back or comes in steps does not go on where it was. That is no
    motion of the robot, so whoever compares with the last tick leaves it out: it is what rho and
    rhodot would have been then, had the reference already moved as it does now, less what they
    were. The signals but ``attitude_error`` are still those of the last tick.
    """
    signals, error, turn, omega = memory.signals, memory.error, memory.turn, memory.omega
    is_known, elapsed = follows(memory.pair, tick), (tick - whole(memory.pair.tick)) * period
    squared = 0.0
    for k in range(3):
        omega[k] = reference.omega_base[k] - elapsed * reference.alpha_base[k]
        turn[1 + k] = -0.25 * elapsed * (omega[k] + reference.omega_base[k])
        squared += turn[1 + k] * turn[1 + k]
    turn[0] = 1.0 - squared * (0.5 - squared / 24.0)  # of the turn since then, to its 5th power
    for k in range(3):
        turn[1 + k] *= 1.0 - squared / 6.0
    error[:] = signals.attitude_error
    attitude_error_into(reference.quaternion, signals.quaternion, error)
    attitude_error_into(turn, error, error)
    rotation_matrix(error, memory.rotation)
    attitude_jacobian(error, memory.turned_jacobian)
    rotate_back(memory.rotation, omega, turn[1:])
    for k in range(3):
        omega[k] = signals.omega_base[k] - turn[1 + k]
    rotate(memory.turned_jacobian, omega, signals.rate_step[:3])
    for k in range(3):
        if is_known:
            signals.rho_step[k] = error[1 + k] - signals.rho[k]
            signals.rate_step[k] -= signals.rho_rate[k]
        else:
            signals.rho_step[k] = signals.rate_step[k] = 0.0


@kernel
def observe_pair(
    memory: ControllerMemory, tick: int, measured: State, estimate: int, period: float
) -> None:
    """Observe force and acceleration of the interval that ended at ``tick``, after the signals.

    With the nominal inertia every axis' acceleration meets the forces of all axes, so all must be
    of the same time. Navigation smooths the rates of base and joints differently; the pair then
    takes them as measured, less the gyro's bias, and has no other low-pass than its own.
    """
    signals, pair = memory.signals, memory.pair
    is_filtered = uniform(memory.navigation.is_filtered) == 1.0
    for k in range(3):
        pair.rate[k] += signals.rate_step[k]
    if is_filtered:
        is_as_measured = 1.0 if estimate == NOMINAL_INERTIA else 0.0
        if uniform(memory.pair_is_as_measured) != is_as_measured:  # rates of the two differ
            pair.seen = 0.0
        memory.pair_is_as_measured = is_as_measured
    if is_filtered and estimate == NOMINAL_INERTIA:
        rate, force, omega = memory.rate_as_measured, memory.force_as_measured, memory.omega
        for k in range(3):
            omega[k] = measured.omega_base[k] - memory.navigation.attitude.bias[k]
        relative_rate(
            omega, measured.joint_velocities, memory.omega_desired, memory.jacobian, omega, rate
        )
        force_from_torque(memory.last_jacobian_inverse, measured.applied_torque, force)
        if uniform(memory.controls_base) == 0.0:
            for k in range(3):
                rate[k] = force[k] = 0.0
        observe(pair, tick, force, rate, signals.acceleration_desired, period)
    else:
        force, rate = signals.applied_force, signals.rho_rate
        observe(pair, tick, force, rate, signals.acceleration_desired, period)
    for i in range(pair.applied_force.size):
        signals.paired_force[i] = pair.applied_force[i]
        signals.paired_acceleration[i] = pair.acceleration[i]


@kernel
def status_of(state: State, desired: Array, controls_base: bool) -> int:
    """Return `USABLE`, or the reason why a state is not usable; ``desired`` is the attitude."""
    quaternion, total = state.quaternion, 0.0
    for k in range(4):
        total += quaternion[k] * quaternion[k]
    square = total
    for k in range(3):
        total += abs(state.omega_base[k])
    for i in range(state.joint_positions.size):
        total += abs(state.joint_positions[i]) + abs(state.joint_velocities[i])
    for i in range(state.applied_torque.size):
        total += abs(state.applied_torque[i])
    for k in range(MOST_WHEELS):
        total += abs(state.wheel_velocities[k]) + abs(state.wheel_torques[k])
    for k in range(3):
        total += abs(state.magnetic_field[k])
    status = USABLE
    if controls_base:
        status = where(abs(error_eta(desired, quaternion)) <= SINGULAR_ETA, SINGULAR, USABLE)
    status = where(abs(square - 1.0) > NORM_TOLERANCE, NOT_UNIT, status)
    status = where(total > LARGEST, TOO_LARGE, status)
    # any number that is not finite makes the sum so
    return where(np.isfinite(total), status, NOT_FINITE)


@kernel
def error_eta(desired: Array, actual: Array) -> float:
    """Return the scalar part of ``q_d* q``, up to its sign."""
    eta = 0.0
    for k in range(4):
        eta += desired[k] * actual[k]
    return eta
