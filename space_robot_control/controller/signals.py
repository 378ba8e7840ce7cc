"""Signals of a tick in the coordinates ``rho = [eps_e, theta]`` of the laws.

A state is checked, passed through navigation and compared with its reference; estimate and nominal
model are added for laws that use them. eps_e is the vector part of the rotation from the desired
attitude, ``q_e = q_d* q``, so that no flight depends on the choice of the inertial frame, and 180
degrees are singular only as an error.
"""

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
from space_robot_msgs_py.compiled.records import Block, Record, nested, shaped
from space_robot_msgs_py.samples import MOST_WHEELS, Reference, State

from ..allocation.allocation import Allocation
from ..laws import Signals
from ..laws.base import CONSTANT_INERTIA, NOMINAL_INERTIA
from ..navigation.navigation import Navigation, navigate
from .time_delay_estimation import (
    TimeDelayPair,
    follows,
    nominal_estimate,
    observe,
    time_delay_estimate,
)

Array = NDArray[np.float64]

NORM_TOLERANCE = 1e-3
"""Tolerance of the squared norm of a quaternion."""
LARGEST = 1e30
"""Largest number of a state or reference: far beyond any flight, and no law's products overflow."""

USABLE, NOT_FINITE, TOO_LARGE, NOT_UNIT, SINGULAR = range(5)
"""The status of a state."""


class ControllerMemory(Record):
    """Memory of the controller, without its law."""

    controls_base: float = shaped(lambda n: (), uniform=True)
    """1; 0: nothing turns the base, so its axes have no signals and no force."""
    signals: Signals = nested(Signals)
    """Signals of the last tick."""
    pair: TimeDelayPair = nested(TimeDelayPair)
    jacobian: Array = shaped(lambda n: (3, 3), "J0 of q_e")
    last_jacobian_inverse: Array = shaped(lambda n: (3, 3), "J0^-1 of the last tick")
    rotation: Array = shaped(lambda n: (3, 3))
    """Scratch: rotation from the base to the desired frame."""
    omega_desired: Array = shaped(lambda n: (3,))
    """Desired angular velocity on the base's axes, rad/s; zero if that is not controlled."""
    error: Array = shaped(lambda n: (4,))
    """Scratch: q_e of the last tick, had the reference moved as it does now."""
    turn: Array = shaped(lambda n: (4,), "Scratch: the desired frame's turn back to the last tick")
    turned_jacobian: Array = shaped(lambda n: (3, 3), "Scratch: J0 of ``error``")
    pair_is_as_measured: float = shaped(lambda n: ())
    """1 if the time-delay pair has rates as they were measured, 0 if as navigation has them."""
    rate_as_measured: Array = shaped(lambda n: (n + 3,))
    """Scratch: rhodot without the navigation's low-pass."""
    force_as_measured: Array = shaped(lambda n: (n + 3,), "Scratch: F_S without the same")
    omega: Array = shaped(lambda n: (3,), "Scratch")
    force: Array = shaped(lambda n: (n + 3,), "F_S commanded")
    transfer: Array = shaped(lambda n: (n + 3,))
    """Applied force minus force of the law in force when it took over."""
    transfer_ticks: float = shaped(lambda n: (), "Length of a transfer", uniform=True)
    transfer_left: float = shaped(lambda n: ())
    """Ticks until ``transfer`` has faded; -1: the law takes over at this tick."""
    navigation: Navigation = nested(Navigation)
    allocation: Allocation = nested(Allocation)


@kernel
def compute_signals(
    block: Block,
    tick: int,
    state: Block,
    h_bar: Array,
    estimate: int,
    uses_model: bool,
    period: float,
) -> int:
    """Compute the signals from a measured or estimated state and the reference that is in them.

    Without a base to control all of them are zero on its axes, and none asks for J0^-1.

    ``block`` is of the `ControllerMemory`, ``state`` of a `State`; ``h_bar``, ``estimate`` and
    ``uses_model`` are those of a `LawCode`.

    Returns:
        `USABLE`, or why the state is not: then nothing was done, but that navigation may have taken
        a measured state that was usable.
    """
    memory, measured = block[0], state[0]
    signals, controls_base = memory.signals, uniform(memory.controls_base) == 1.0
    reference = signals.reference
    is_filtered, desired = uniform(memory.navigation.is_filtered) == 1.0, reference.quaternion
    status: int = status_of(measured, desired, controls_base)
    if all_lanes(status != USABLE):
        return status
    # the actuators' allocation needs what was measured, navigation or not
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
        # while the signals are still those of the last tick
        _compute_reference_steps(memory, tick, period)
        rotation_matrix(near, memory.rotation)
        rotate_back(memory.rotation, reference.omega_base, memory.omega_desired)
        if not follows(memory.pair, tick):  # whatever J0 was, this one's is nearer
            attitude_jacobian_inverse(near, memory.last_jacobian_inverse)
        # the applied torque acted from the last tick on, so that tick's J0 turns it into F_S
        force_from_torque(
            memory.last_jacobian_inverse, measured.applied_torque, signals.applied_force
        )
    else:
        # a free base has no desired attitude: the model is taken where it is, its axes are zero
        near[:] = measured.quaternion
        signals.applied_force[:] = measured.applied_torque
    _relative_rate(
        measured.omega_base,
        measured.joint_velocities,
        memory.omega_desired,
        memory.jacobian,
        memory.omega,
        signals.rho_rate,
    )
    signals.tick = tick
    signals.time = tick * period
    _compute_errors(measured, signals, controls_base)
    _observe_pair(memory, tick, state[0], estimate, period)
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
    # N_hat of (36)
    if estimate == CONSTANT_INERTIA:
        time_delay_estimate(memory.pair, h_bar, signals.n_hat)
    elif estimate == NOMINAL_INERTIA:
        nominal_estimate(memory.pair, signals.nominal.inertia, signals.n_hat)
    return status


@kernel
def _compute_reference_steps(memory: ControllerMemory, tick: int, period: float) -> None:
    """Write the steps of rho and rhodot since the last tick that the base's reference makes.

    A reference that is held, comes back or comes in steps does not continue its motion. That is no
    motion of the robot, so differences to the last tick leave it out: it is what rho and rhodot
    would have been then, had the reference already moved as it does now, less what they were. All
    signals but ``attitude_error`` and the reference are still those of the last tick.
    """
    signals, error, turn, omega = memory.signals, memory.error, memory.turn, memory.omega
    reference = signals.reference
    is_known, elapsed = follows(memory.pair, tick), (tick - whole(memory.pair.tick)) * period
    squared = 0.0
    for k in range(3):
        omega[k] = reference.omega_base[k] - elapsed * reference.alpha_base[k]
        turn[1 + k] = -0.25 * elapsed * (omega[k] + reference.omega_base[k])
        squared += turn[1 + k] * turn[1 + k]
    # the turn since then by the series of sine and cosine, to its 5th power
    turn[0] = 1.0 - squared * (0.5 - squared / 24.0)
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
def _observe_pair(
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
        _relative_rate(
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
    # one sum of all numbers instead of a test of each
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


@kernel
def _relative_rate(
    omega_base: Array,
    joint_velocities: Array,
    omega_desired: Array,
    jacobian: Array,
    omega: Array,
    rate: Array,
) -> None:
    """Write rhodot (m,) of (22) into ``rate``; ``jacobian`` is J0 of q_e, ``omega`` scratch."""
    # epsdot_e = J0(q_e) omega_e, omega_e = omega - R_e^T omega_d
    for k in range(3):
        omega[k] = omega_base[k] - omega_desired[k]
    rotate(jacobian, omega, rate[:3])
    rate[3:] = joint_velocities


@kernel
def _compute_errors(state: State, signals: Signals, controls_base: bool) -> None:
    """Write rho, e, edot and rhodd_d into ``signals``, which has rhodot and the base's attitude."""
    error, error_rate, reference = signals.error, signals.error_rate, signals.reference
    for k in range(4):  # one loop for several arrays: each copy of a slice costs 1 % of a tick
        signals.quaternion[k] = state.quaternion[k]
    for k in range(3):
        signals.omega_base[k] = state.omega_base[k]
        signals.rho[k] = signals.attitude_error[1 + k]
        # rho_d of the base is 0; a difference, since -0.0 would be another bit than 0.0 - 0.0
        error[k] = 0.0 - signals.rho[k]
        error_rate[k] = 0.0 - signals.rho_rate[k]
        signals.acceleration_desired[k] = 0.0
        if not controls_base:
            error[k] = error_rate[k] = signals.rho[k] = 0.0
            signals.rho_rate[k] = signals.applied_force[k] = 0.0
    for i in range(state.joint_positions.size):
        signals.joint_positions[i] = state.joint_positions[i]
        signals.joint_velocities[i] = state.joint_velocities[i]
        signals.rho[3 + i] = state.joint_positions[i]
        error[3 + i] = reference.joint_positions[i] - state.joint_positions[i]
        error_rate[3 + i] = reference.joint_velocities[i] - signals.rho_rate[3 + i]
        signals.acceleration_desired[3 + i] = reference.joint_accelerations[i]


@kernel
def copy_reference(reference: Reference, desired: Reference) -> None:
    """Copy a reference into another record."""
    for k in range(4):
        desired.quaternion[k] = reference.quaternion[k]
    for k in range(3):
        desired.omega_base[k] = reference.omega_base[k]
        desired.alpha_base[k] = reference.alpha_base[k]
    for i in range(reference.joint_positions.size):
        desired.joint_positions[i] = reference.joint_positions[i]
        desired.joint_velocities[i] = reference.joint_velocities[i]
        desired.joint_accelerations[i] = reference.joint_accelerations[i]


@kernel
def torque_from_force(jacobian: Array, force: Array, torque: Array) -> None:
    """Compute ``tau = J^T F_S`` with J of (23), the torques of base and joints.

    What ``torque`` has behind them, for actuators of the base, is left alone.
    """
    rotate_back(jacobian, force[:3], torque[:3])
    torque[3 : force.size] = force[3:]


@kernel
def force_from_torque(jacobian_inverse: Array, torque: Array, force: Array) -> None:
    """Compute ``F_S = J^-T tau``, the inverse of `torque_from_force`."""
    rotate_back(jacobian_inverse, torque[:3], force[:3])
    force[3:] = torque[3:]
