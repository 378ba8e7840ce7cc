"""A tick of the controller as kernels: errors, estimate or model, law, transfer, torque."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, nested, shaped
from space_robot_sim.dynamics.attitude import SINGULAR_ETA, attitude_jacobian_inverse
from space_robot_sim.dynamics.model import Model
from space_robot_sim.dynamics.rho_space import RhoSpaceModel, rho_space_into

from .time_delay_estimation import TimeDelayPair, follows, observe, time_delay_estimate
from .tracking import force_from_torque, measured_rate, torque_from_force, tracking_errors

Array = NDArray[np.float64]
Block = NDArray[Any]

NORM_TOLERANCE = 1e-3
"""How far the square of a quaternion's norm may be from 1."""
LARGEST = 1e30
"""No number of a state or reference is larger: far beyond any flight, yet no law's products of
such numbers overflow."""

USABLE, NOT_FINITE, TOO_LARGE, NOT_UNIT, SINGULAR = range(5)
"""What `form_signals` finds a state to be."""


class ControllerMemory(Record):
    """What the controller knows and remembers, apart from its law."""

    model: Model = nested(Model)
    """The nominal robot."""
    nominal: RhoSpaceModel = nested(RhoSpaceModel)
    pair: TimeDelayPair = nested(TimeDelayPair)
    quaternion: Array = shaped(lambda n: (4,))
    """The measured one or its negative: the same attitude, but rho must not jump."""
    rate: Array = shaped(lambda n: (n + 3,))
    """rhodot."""
    jacobian: Array = shaped(lambda n: (3, 3))
    """J0."""
    last_jacobian_inverse: Array = shaped(lambda n: (3, 3))
    """J0^-1 of the last tick."""
    desired_jacobian: Array = shaped(lambda n: (3, 3))
    """Scratch."""
    applied_force: Array = shaped(lambda n: (n + 3,))
    """F_S over the last interval."""
    error: Array = shaped(lambda n: (n + 3,))
    error_rate: Array = shaped(lambda n: (n + 3,))
    acceleration_desired: Array = shaped(lambda n: (n + 3,))
    n_hat: Array = shaped(lambda n: (n + 3,))
    """These four as in `Signals`."""
    force: Array = shaped(lambda n: (n + 3,))
    """F_S commanded."""
    transfer: Array = shaped(lambda n: (n + 3,))
    """What the law in force lacked of the applied force when it took over."""
    transfer_ticks: float = shaped(lambda n: ())
    """Length of a transfer."""
    transfer_left: float = shaped(lambda n: ())
    """Ticks until ``transfer`` has faded; -1: the law takes over at this tick."""


@kernel
def sense(
    block: Block, tick: int, quaternion: Array, omega_base: Array, joint_positions: Array,
    joint_velocities: Array, applied_torque: Array, joints: Array, base: Array, h_bar: Array,
    uses_model: bool, period: float,
) -> int:  # fmt: skip
    """`form_signals` for callers from Python."""
    found: int = form_signals(
        block[0], tick, quaternion, omega_base, joint_positions, joint_velocities, applied_torque,
        joints, base, h_bar, uses_model, period,
    )  # fmt: skip
    return found


@kernel
def actuate(block: Block, tick: int, force: Array, torque: Array) -> None:
    """`transferred_torque` for callers from Python."""
    transferred_torque(block[0], tick, force, torque)


@kernel
def answer(
    memory: ControllerMemory, law: Callable[..., None], gains: Array, law_memory: Array,
    h_bar: Array, uses_model: bool, tick: int, quaternion: Array, omega_base: Array,
    joint_positions: Array, joint_velocities: Array, applied_torque: Array, joints: Array,
    base: Array, torque: Array, period: float,
) -> int:  # fmt: skip
    """A whole tick of the controller under a law given as a function pointer.

    Returns:
        What `form_signals` finds; ``torque`` is written if that is `USABLE`.
    """
    found: int = form_signals(
        memory, tick, quaternion, omega_base, joint_positions, joint_velocities, applied_torque,
        joints, base, h_bar, uses_model, period,
    )  # fmt: skip
    if found == USABLE:
        law(  # slices: a pointer's arguments are arrays of any length
            memory.error[:], memory.error_rate[:], memory.acceleration_desired[:],
            memory.n_hat[:], memory.nominal.inertia[:], memory.nominal.bias[:], gains, law_memory,
            period,
        )  # fmt: skip
        transferred_torque(memory, tick, law_memory[2], torque)
    return found


@kernel
def transferred_torque(memory: ControllerMemory, tick: int, force: Array, torque: Array) -> None:
    """The torque of a law's ``force`` (m,), which takes over from the one applied before.

    ``F_S + (F_applied - F_S at the takeover) fade``, the fade falling from 1 to 0. At tick 0
    nothing has been applied, so nothing is taken over.
    """
    if memory.transfer_left < 0.0:
        memory.transfer_left = memory.transfer_ticks if tick > 0 else 0.0
        for i in range(force.size):
            memory.transfer[i] = memory.applied_force[i] - force[i]
    fade = memory.transfer_left / memory.transfer_ticks
    for i in range(force.size):
        memory.force[i] = force[i]
        if fade > 0.0:
            memory.force[i] += fade * memory.transfer[i]
    if fade > 0.0:
        memory.transfer_left -= 1.0
    torque_from_force(memory.jacobian, memory.force, torque)


@kernel
def form_signals(
    memory: ControllerMemory, tick: int, quaternion: Array, omega_base: Array,
    joint_positions: Array, joint_velocities: Array, applied_torque: Array, joints: Array,
    base: Array, h_bar: Array, uses_model: bool, period: float,
) -> int:  # fmt: skip
    """Turn a measured state and a reference row into the law's signals.

    ``h_bar`` is empty for a law without time-delay estimate.

    Returns:
        `USABLE`, or why the state is not: then nothing was done.
    """
    near, rate, dot, square = memory.quaternion, memory.rate, 0.0, 0.0
    for k in range(4):
        dot += quaternion[k] * near[k]
        square += quaternion[k] * quaternion[k]
    total = square
    for k in range(3):
        total += abs(omega_base[k])
    for i in range(joint_positions.size):
        total += abs(joint_positions[i]) + abs(joint_velocities[i])
    for i in range(applied_torque.size):
        total += abs(applied_torque[i])
    if not np.isfinite(total):  # any number that is not makes the sum so
        return NOT_FINITE
    if total > LARGEST:
        return TOO_LARGE
    if abs(square - 1.0) > NORM_TOLERANCE:
        return NOT_UNIT
    side = -1.0 if dot < 0.0 else 1.0
    if abs(quaternion[0]) <= SINGULAR_ETA:
        return SINGULAR
    for k in range(4):
        near[k] = side * quaternion[k]
    measured_rate(near, omega_base, joint_velocities, memory.jacobian, rate)
    if not follows(memory.pair, tick):  # whatever J0 was, this one's is nearer
        attitude_jacobian_inverse(near, memory.last_jacobian_inverse)
    # the applied torque acted from the last tick on, so that tick's J0 turns it into F_S
    force_from_torque(memory.last_jacobian_inverse, applied_torque, memory.applied_force)
    attitude_jacobian_inverse(near, memory.last_jacobian_inverse)
    tracking_errors(
        near, joint_positions, rate, joints, base, memory.desired_jacobian,
        memory.error, memory.error_rate, memory.acceleration_desired,
    )  # fmt: skip
    observe(memory.pair, tick, memory.applied_force, rate, memory.acceleration_desired, period)
    if h_bar.size > 0:
        time_delay_estimate(memory.pair, h_bar, memory.n_hat)
    if uses_model:
        rho_space_into(
            memory.model, near, joint_positions, omega_base, joint_velocities, memory.nominal
        )
    return USABLE
