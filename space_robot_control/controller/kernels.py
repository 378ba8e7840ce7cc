"""Compiled kernels of a controller tick: errors, estimate or model, law, transfer, torque."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import SINGULAR_ETA, attitude_jacobian_inverse, rotate
from space_robot_model.dynamics.free_floating import eliminate_rotation
from space_robot_model.dynamics.rho_space import semi_floating_into, to_rho_space
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.lanes import all_lanes, uniform, where
from space_robot_msgs_py.compiled.records import Block, Record, nested, shaped
from space_robot_msgs_py.samples import MOST_WHEELS, State

from ..allocation.allocation import Allocation
from ..laws import Signals
from ..laws.base import CONSTANT_INERTIA, NOMINAL_INERTIA
from ..laws.compiled import LawCode
from ..navigation.navigation import Navigation, navigate
from .time_delay_estimation import (
    TimeDelayPair,
    follows,
    nominal_estimate,
    observe,
    time_delay_estimate,
)
from .tracking import (
    force_from_torque,
    leave_base_out,
    measured_rate,
    show_state,
    torque_from_force,
    tracking_errors,
)

Array = NDArray[np.float64]

NORM_TOLERANCE = 1e-3
"""Tolerance of the squared norm of a quaternion."""
LARGEST = 1e30
"""No number of a state or reference is larger: far beyond any flight, yet no law's products of
such numbers overflow."""

USABLE, NOT_FINITE, TOO_LARGE, NOT_UNIT, SINGULAR = range(5)
"""The status of a state."""


class ControllerMemory(Record):
    """Memory of the controller, without its law."""

    controls_base: float = shaped(lambda n: (), uniform=True)
    """1; 0: nothing turns the base, so its axes have no signals and no force."""
    signals: Signals = nested(Signals)
    """Signals of the last tick."""
    pair: TimeDelayPair = nested(TimeDelayPair)
    quaternion: Array = shaped(lambda n: (4,))
    """The measured one or its negative: the same attitude, but rho must not jump."""
    jacobian: Array = shaped(lambda n: (3, 3))
    """J0."""
    last_jacobian_inverse: Array = shaped(lambda n: (3, 3))
    """J0^-1 of the last tick."""
    desired_jacobian: Array = shaped(lambda n: (3, 3))
    """Scratch."""
    pair_is_as_measured: float = shaped(lambda n: (), uniform=True)
    """1 if the time-delay pair has rates as they were measured, 0 if as navigation has them."""
    rate_as_measured: Array = shaped(lambda n: (n + 3,))
    """Scratch: rhodot without the navigation's low-pass."""
    force_as_measured: Array = shaped(lambda n: (n + 3,))
    """Scratch: F_S without the same."""
    omega: Array = shaped(lambda n: (3,))
    """Scratch."""
    force: Array = shaped(lambda n: (n + 3,))
    """F_S commanded."""
    transfer: Array = shaped(lambda n: (n + 3,))
    """Applied force minus force of the law in force when it took over."""
    transfer_ticks: float = shaped(lambda n: (), uniform=True)
    """Length of a transfer."""
    transfer_left: float = shaped(lambda n: ())
    """Ticks until ``transfer`` has faded; -1: the law takes over at this tick."""
    navigation: Navigation = nested(Navigation)
    allocation: Allocation = nested(Allocation)


@kernel
def controller_tick(
    block: Block,
    law: LawCode,
    allocate: RecordFunction,
    tick: int,
    state: Block,
    reference: Block,
    torque: Array,
    period: float,
) -> int:
    """Run a whole tick of the controller with a compiled law.

    Args:
        block: of the `ControllerMemory`.
        law: a `CompiledLaw.code`.
        allocate: an `allocation_code`.
        tick: of the state.
        state: of a `State`.
        reference: of a `Reference`.
        torque: (m+A,) command to be written, if the state is `USABLE`: torque of every axis,
            N m, then what is asked of each of the base's actuators.
        period: s.

    Returns:
        The status of the state, see `compute_signals`.
    """
    status: int = compute_signals(
        block, tick, state, reference, law.h_bar, law.estimate, law.uses_model, period
    )
    if status == USABLE:
        compute_command(block, law, allocate, tick, torque, period)
    return status


@kernel
def compute_command(
    block: Block, law: LawCode, allocate: RecordFunction, tick: int, torque: Array, period: float
) -> None:
    """Compute the command of a tick from its signals, see `controller_tick`."""
    law.run(block[0].signals, law.gains[0], law.memory[0], period)
    if law.estimate == NOMINAL_INERTIA and law.h_bar.size > 0:
        add_nominal_inertia(block, law.memory[0].u, law.memory[0].force)
    apply_transfer(block, tick, law.memory[0].force, torque)
    allocation, axes = block[0].allocation, law.memory[0].force.size
    allocate(allocation, float(tick))
    for k in range(axes, torque.size):
        torque[k] = allocation.command[k - axes]


@kernel
def add_nominal_inertia(block: Block, u: Array, force: Array) -> None:
    """Add ``H_S u`` to the ``force`` (m,) of a law with the gain ``h_bar: nominal``."""
    inertia = block[0].signals.nominal.inertia
    for i in range(u.size):
        for j in range(u.size):
            force[i] += inertia[i, j] * u[j]


@kernel
def engage(block: Block) -> None:
    """Let a law, whose memory has been cleared, take over from the applied force."""
    memory = block[0]
    memory.signals.n_hat[:] = 0.0
    memory.transfer_left = -1.0


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
    memory, measured = block[0], state[0]
    signals, controls_base = memory.signals, uniform(memory.controls_base) == 1.0
    rate, is_filtered = signals.rho_rate, uniform(memory.navigation.is_filtered) == 1.0
    status: int = status_of(measured, controls_base)
    if all_lanes(status != USABLE):
        return status
    memory.allocation.reported_speeds[:] = measured.wheel_velocities
    memory.allocation.reported_torques[:] = measured.wheel_torques
    memory.allocation.torquers.magnetic_field[:] = measured.magnetic_field
    if is_filtered:
        navigate(memory.navigation, tick, measured, period)
        measured = memory.navigation.estimate
        status = where(status == USABLE, status_of(measured, controls_base), status)
        if all_lanes(status != USABLE):
            return status
    near, dot = memory.quaternion, 0.0
    for k in range(4):
        dot += measured.quaternion[k] * near[k]
    side = where(dot < 0.0, -1.0, 1.0)
    for k in range(4):
        near[k] = side * measured.quaternion[k]
    measured_rate(measured, near, memory.jacobian, rate)
    if controls_base:
        if not follows(memory.pair, tick):  # whatever J0 was, this one's is nearer
            attitude_jacobian_inverse(near, memory.last_jacobian_inverse)
        # the applied torque acted from the last tick on, so that tick's J0 turns it into F_S
        force_from_torque(
            memory.last_jacobian_inverse, measured.applied_torque, signals.applied_force
        )
    else:
        signals.applied_force[:] = measured.applied_torque
    signals.tick = tick
    signals.time = tick * period
    show_state(measured, near, reference[0], signals)
    tracking_errors(measured, near, rate, reference[0], memory.desired_jacobian, signals)
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
            to_rho_space(near, signals.nominal)
        else:
            eliminate_rotation(signals.nominal)
    if estimate == CONSTANT_INERTIA:
        time_delay_estimate(memory.pair, h_bar, signals.n_hat)
    elif estimate == NOMINAL_INERTIA:
        nominal_estimate(memory.pair, signals.nominal.inertia, signals.n_hat)
    return status


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
    if is_filtered:
        is_as_measured = 1.0 if estimate == NOMINAL_INERTIA else 0.0
        if uniform(memory.pair_is_as_measured) != is_as_measured:  # rates of the two differ
            pair.seen = 0.0
        memory.pair_is_as_measured = is_as_measured
    if is_filtered and estimate == NOMINAL_INERTIA:
        rate, force, omega = memory.rate_as_measured, memory.force_as_measured, memory.omega
        for k in range(3):
            omega[k] = measured.omega_base[k] - memory.navigation.attitude.bias[k]
        rotate(memory.jacobian, omega, rate[:3])
        rate[3:] = measured.joint_velocities
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
def status_of(state: State, controls_base: bool) -> int:
    """Return `USABLE`, or the reason why a state is not usable."""
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
        status = where(abs(quaternion[0]) <= SINGULAR_ETA, SINGULAR, USABLE)
    status = where(abs(square - 1.0) > NORM_TOLERANCE, NOT_UNIT, status)
    status = where(total > LARGEST, TOO_LARGE, status)
    # any number that is not finite makes the sum so
    return where(np.isfinite(total), status, NOT_FINITE)


@kernel
def apply_transfer(block: Block, tick: int, force: Array, torque: Array) -> None:
    """Write the ``torque`` of a law's ``force`` (m,), which takes over from the one applied before.

    ``F_S + (F_applied - F_S at the takeover) fade``, the fade falling from 1 to 0. At tick 0
    nothing has been applied, so nothing is taken over. A base that is not controlled gets none.
    The base's part is what its actuators are asked for.
    """
    memory = block[0]
    if uniform(memory.transfer_left) < 0.0:
        memory.transfer_left = uniform(memory.transfer_ticks) if tick > 0 else 0.0
        for i in range(force.size):
            memory.transfer[i] = memory.signals.applied_force[i] - force[i]
    fade = uniform(memory.transfer_left) / uniform(memory.transfer_ticks)
    for i in range(force.size):
        memory.force[i] = force[i]
        if fade > 0.0:
            memory.force[i] += fade * memory.transfer[i]
    if fade > 0.0:
        memory.transfer_left -= 1.0
    torque_from_force(memory.jacobian, memory.force, torque)
    if uniform(memory.controls_base) == 0.0:
        for k in range(3):
            memory.force[k] = torque[k] = 0.0
    memory.allocation.demand[:] = torque[:3]
