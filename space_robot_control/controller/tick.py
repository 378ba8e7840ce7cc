"""The tick of a controller: every state is answered, by the law or by a safe command.

    stamp --> judge_stamp --> admit_state --> compute_command --> conclude --> command
                              checks, navigation,   law, transfer,     hold, then
                              signals               allocation         safe mode

`controller_tick` is the same without the supervision, for loops whose flight ends with a state that
is not usable. Kernels have these arguments in common:

- ``block``: of the `Supervision`, or of the `ControllerMemory` where ``controller`` is not given,
- ``law``: a `CompiledLaw.code`; ``allocate``: an `allocation_code`,
- ``tick``: of the state; ``state``, ``reference``: of a `State` and a `Reference`; ``period``: s.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.rho_space import force_for
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.lanes import uniform
from space_robot_msgs_py.compiled.records import Block, Record, nested, shaped
from space_robot_msgs_py.samples import MOST_ACTUATORS, Reference
from space_robot_msgs_py.wire.stamp_guard import accept

from ..laws.base import LawCode
from .signals import (
    LARGEST,
    NORM_TOLERANCE,
    SINGULAR,
    USABLE,
    compute_signals,
    copy_reference,
    error_eta,
    torque_from_force,
)
from .time_delay_estimation import LONGEST_GAP

Array = NDArray[np.float64]

NOMINAL, HOLDING, SAFE = range(3)
MODES = ("nominal", "holding", "safe")
"""The modes of commands."""
ANSWERED, NEW, REFUSED = range(3)
"""A received state by its stamp: answered last; to be answered; not plausible."""
LAST_TICK = 1 << 52
"""Largest tick that is answered: up to here a float has every integer."""
REFERENCE_HELD = SINGULAR + 1
"""Status of a usable state whose reference is not: the law holds the last usable one, at rest."""
NO_REFERENCE = SINGULAR + 2
"""The same where none has been usable: there is no command of the law."""
STATUSES = NO_REFERENCE + 1
"""Number of different statuses of a state."""
SAFE_BELOW_ETA = 0.02
"""|eta| of the error below which the mode is safe, since torques grow without bound: 177.7 degrees
from the desired attitude."""
NOMINAL_FROM_ETA = 0.05
"""|eta| from which it is nominal again: 174.3 degrees."""


class Stamps(Record):
    """Check of the stamps of states, see `StampGuard`."""

    longest_jump: float = shaped(lambda n: (), "Largest accepted step, ticks")
    last: float = shaped(lambda n: (), "Last accepted tick; -1 before the first")
    is_new_time: float = shaped(lambda n: ())
    """1 if the last accepted tick started a new time, else 0."""
    other: float = shaped(lambda n: (), "Last rejected tick")
    agreeing: float = shaped(lambda n: ())
    """Number of consistent ticks that were rejected one after the other."""


class Supervision(Record):
    """Settings and memory of a supervisor."""

    hold_ticks: float = shaped(lambda n: (), "Invalid states for which the last torque is held")
    first_valve: float = shaped(lambda n: (), "Index of the first thruster in ``command``")
    stamps: Stamps = nested(Stamps)
    answered: float = shaped(lambda n: (), "Last tick answered; -1: none")
    mode: float = shaped(lambda n: (), "`NOMINAL`, `HOLDING` or `SAFE`")
    reason: float = shaped(lambda n: ())
    """Status of the last state; in nominal mode `USABLE` or `REFERENCE_HELD`."""
    last_tick: float = shaped(lambda n: (), "Last tick answered by the law; -1: none")
    has_reference: float = shaped(lambda n: (), "1 once a reference has been usable, else 0")
    held_since: float = shaped(lambda n: (), "Tick at which holding began")
    rejected: Array = shaped(lambda n: (STATUSES,))
    """Number of states not used, or whose reference was not, by status."""
    command: Array = shaped(lambda n: (n + 3 + MOST_ACTUATORS,))
    """Answer to the last state: torque of every axis, N m, then what is asked of each of the
    base's actuators, N m and N."""


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
    """Run a whole tick of the controller with a compiled law; return the status of the state.

    If that is `USABLE`, the command is written into ``torque`` (m+A,): torque of every axis, N m,
    then what is asked of each of the base's actuators.
    """
    copy_reference(reference[0], block[0].signals.reference)
    status: int = compute_signals(
        block, tick, state, law.h_bar, law.estimate, law.uses_model, period
    )
    if status == USABLE:
        compute_command(block, law, allocate, tick, torque, period)
    return status


@kernel
def compute_command(
    block: Block, law: LawCode, allocate: RecordFunction, tick: int, torque: Array, period: float
) -> None:
    """Compute the command of a tick from its signals, see `controller_tick`."""
    signals, memory = block[0].signals, law.memory[0]
    law.run(signals, law.gains[0], memory, period)
    if law.adds_inertia:
        force_for(signals.nominal, memory.u, memory.force, memory.force)
    apply_transfer(block, tick, memory.force, torque)
    allocation, axes = block[0].allocation, memory.force.size
    allocate(allocation, float(tick))
    for k in range(axes, torque.size):
        torque[k] = allocation.command[k - axes]


@kernel
def engage(block: Block) -> None:
    """Let a law, whose memory has been cleared, take over from the applied force."""
    memory = block[0]
    memory.signals.n_hat[:] = 0.0
    memory.transfer_left = -1.0


@kernel
def apply_transfer(block: Block, tick: int, force: Array, torque: Array) -> None:
    """Write the ``torque`` of a law's ``force`` (m,), which takes over from the one applied before.

    The fade falls from 1 to 0. At tick 0 nothing has been applied, so nothing is taken over. A base
    that is not controlled gets none. The base's part is the demand on its actuators.
    """
    memory = block[0]
    if uniform(memory.transfer_left) < 0.0:
        memory.transfer_left = uniform(memory.transfer_ticks) if tick > 0 else 0.0
        for i in range(force.size):
            memory.transfer[i] = memory.signals.applied_force[i] - force[i]
    # F_S + (F_applied - F_S at the takeover) fade
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


accept_stamp = kernel(accept)
"""`accept`, compiled."""


@kernel
def judge_stamp(block: Block, tick: int) -> int:
    """Return `ANSWERED`, `NEW` or `REFUSED` for a state of ``tick``."""
    supervision = block[0]
    if tick < 0 or tick > LAST_TICK:
        return REFUSED
    if tick == supervision.answered:
        return ANSWERED
    if tick == supervision.stamps.last or accept_stamp(supervision.stamps, tick):
        return NEW
    return REFUSED


@kernel
def swaps_due(ticks: Array, made: int, tick: int) -> int:
    """Return how many swaps at the increasing ``ticks`` (k,) are due; ``made`` have been."""
    due = made
    while due < ticks.size and ticks[due] <= tick:
        due += 1
    return due


@kernel
def takes_over(block: Block, tick: int) -> bool:
    """Return whether the law has to take over at ``tick``: after safe mode, a gap, at the start."""
    supervision = block[0]
    gap = tick - supervision.last_tick
    return bool(supervision.mode == SAFE or gap < 1.0 or gap > LONGEST_GAP)


@kernel
def answer_state(
    block: Block,
    controller: Block,
    law: LawCode,
    allocate: RecordFunction,
    tick: int,
    state: Block,
    reference: Block,
    period: float,
) -> int:
    """Write the command for a state, from the law or safe, into ``command`` of the supervision.

    Returns:
        The status of the state.
    """
    status = admit_state(
        block, controller, law.h_bar, law.estimate, law.uses_model, tick, state, reference, period
    )
    if is_for_law(status):
        compute_command(controller, law, allocate, tick, block[0].command, period)
    conclude(block, tick, status)
    return status


@kernel
def admit_state(
    block: Block,
    controller: Block,
    h_bar: Array,
    estimate: int,
    uses_model: bool,
    tick: int,
    state: Block,
    reference: Block,
    period: float,
) -> int:
    """Compute the signals of a state that is usable, and not too near to an error of 180 degrees.

    Returns:
        The status of the state.
    """
    desired = controller[0].signals.reference
    quaternion = state[0].quaternion
    status_with_reference: int = take_reference(block[0], reference[0], quaternion, desired)
    least = NOMINAL_FROM_ETA if block[0].mode == SAFE else SAFE_BELOW_ETA
    # hysteresis: from safe mode back only when the error is clearly smaller
    is_near = abs(error_eta(desired.quaternion, quaternion)) < least
    if is_near and is_unit(quaternion) and controller[0].controls_base == 1.0:
        return SINGULAR
    status: int = compute_signals(controller, tick, state, h_bar, estimate, uses_model, period)
    return status_with_reference if status == USABLE else status


@kernel
def take_reference(
    supervision: Supervision, reference: Reference, quaternion: Array, desired: Reference
) -> int:
    """Copy a usable reference into ``desired``; of another one, make that rest where it was.

    Until one is usable, the base is desired to be where it is, at ``quaternion`` (4,).
    Its quaternion is unit; the other conditions are those of a `ReferenceBuffer`, which holds the
    same.

    Returns:
        `USABLE`, `REFERENCE_HELD` or `NO_REFERENCE`.
    """
    is_usable = is_unit(reference.quaternion)
    for k in range(3):
        is_usable = is_usable and abs(reference.omega_base[k]) <= LARGEST
        is_usable = is_usable and abs(reference.alpha_base[k]) <= LARGEST
    for i in range(reference.joint_positions.size):
        is_usable = is_usable and abs(reference.joint_positions[i]) <= LARGEST
        is_usable = is_usable and abs(reference.joint_velocities[i]) <= LARGEST
        is_usable = is_usable and abs(reference.joint_accelerations[i]) <= LARGEST
    if is_usable:
        copy_reference(reference, desired)
        supervision.has_reference = 1.0
        return USABLE
    # rest where it was: with its last velocity it would drift away
    desired.joint_velocities[:] = desired.joint_accelerations[:] = 0.0
    desired.omega_base[:] = desired.alpha_base[:] = 0.0
    if supervision.has_reference == 1.0:
        return REFERENCE_HELD
    desired.quaternion[:] = quaternion
    return NO_REFERENCE


@kernel
def is_for_law(status: int) -> bool:
    """Return whether the law answers a state of a ``status``."""
    return status == USABLE or status == REFERENCE_HELD  # kernels have no `in`


@kernel
def is_unit(quaternion: Array) -> bool:
    """Return whether a quaternion is close enough to unit norm."""
    total = 0.0
    for k in range(4):
        total += quaternion[k] * quaternion[k]
    length = math.sqrt(total)
    return bool(abs(length * length - 1.0) <= NORM_TOLERANCE)


@kernel
def conclude(block: Block, tick: int, status: int) -> None:
    """End the answer to a state of a ``status``: the law's command, or a safe one."""
    supervision = block[0]
    supervision.answered = tick
    supervision.reason = status
    if status != USABLE:
        supervision.rejected[status] += 1.0
    if is_for_law(status):
        supervision.last_tick = tick
        supervision.mode = NOMINAL
        return
    command = supervision.command
    # how long a pulse is to be is not known: valves are closed, the other torques are held
    if supervision.mode == NOMINAL:
        supervision.mode = HOLDING
        supervision.held_since = tick
        for k in range(int(supervision.first_valve), command.size):
            command[k] = 0.0
    held = tick - supervision.held_since
    if status == SINGULAR or held < 0.0 or held >= supervision.hold_ticks:
        supervision.mode = SAFE
        for k in range(command.size):
            command[k] = 0.0
