"""Supervision of a controller in one record: kernels that answer every state, good or bad.

They call nothing of Python and know no ROS, so they are what flies, compiled here or as C.
`.supervisor` explains the modes.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.records import Block, Record, nested, shaped
from space_robot_msgs_py.samples import MOST_THRUSTERS, MOST_TORQUERS, MOST_WHEELS, Reference
from space_robot_msgs_py.wire.stamp_guard import accept

from ..laws.base import LawCode
from .kernels import compute_command
from .signal_kernels import (
    LARGEST,
    NORM_TOLERANCE,
    SINGULAR,
    USABLE,
    compute_signals_for,
    error_eta,
)
from .time_delay_estimation import LONGEST_GAP

Array = NDArray[np.float64]

NOMINAL, HOLDING, SAFE = range(3)
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

    longest_jump: float = shaped(lambda n: ())
    """Largest accepted step, ticks."""
    last: float = shaped(lambda n: ())
    """Last accepted tick; -1 before the first."""
    is_new_time: float = shaped(lambda n: ())
    """1 if the last accepted tick started a new time, else 0."""
    other: float = shaped(lambda n: ())
    """Last rejected tick."""
    agreeing: float = shaped(lambda n: ())
    """Number of consistent ticks that were rejected one after the other."""


class Supervision(Record):
    """Settings and memory of a supervisor."""

    hold_ticks: float = shaped(lambda n: ())
    """Invalid states for which the last torque is held."""
    first_valve: float = shaped(lambda n: ())
    """Index of the first thruster in ``command``."""
    stamps: Stamps = nested(Stamps)
    answered: float = shaped(lambda n: ())
    """Last tick answered; -1: none."""
    mode: float = shaped(lambda n: ())
    """`NOMINAL`, `HOLDING` or `SAFE`."""
    reason: float = shaped(lambda n: ())
    """Status of the last state; in nominal mode `USABLE` or `REFERENCE_HELD`."""
    last_tick: float = shaped(lambda n: ())
    """Last tick answered by the law; -1: none."""
    has_reference: float = shaped(lambda n: ())
    """1 once a reference has been usable, else 0."""
    held_since: float = shaped(lambda n: ())
    """Tick at which holding began."""
    rejected: Array = shaped(lambda n: (STATUSES,))
    """Number of states not used, or whose reference was not, by status."""
    command: Array = shaped(lambda n: (n + 3 + MOST_WHEELS + MOST_THRUSTERS + MOST_TORQUERS,))
    """Answer to the last state: torque of every axis, N m, then what is asked of each of the
    base's actuators, N m and N."""


accept_stamp = kernel(accept)
"""`accept`, compiled."""


@kernel
def judge(block: Block, tick: int) -> int:
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
    """Return how many swaps are due at ``tick``; ``made`` have been.

    Args:
        ticks: (k,) of the swaps, increasing.
        made: number of those already made.
        tick: that is to be answered.
    """
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

    Args:
        block: of the `Supervision`.
        controller: of the `ControllerMemory`.
        law: a `CompiledLaw.code`.
        allocate: an `allocation_code`.
        tick: of the state.
        state: of a `State`.
        reference: of a `Reference`.
        period: s.

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

    Args: see `compute_signals`.

    Returns:
        The status of the state.
    """
    desired = controller[0].signals.reference
    quaternion = state[0].quaternion
    status_with_reference: int = take_reference(block[0], reference[0], quaternion, desired)
    least = NOMINAL_FROM_ETA if block[0].mode == SAFE else SAFE_BELOW_ETA
    is_near = abs(error_eta(desired.quaternion, quaternion)) < least
    if is_near and is_unit(quaternion) and controller[0].controls_base == 1.0:
        return SINGULAR
    status: int = compute_signals_for(
        controller, tick, state, desired, h_bar, estimate, uses_model, period
    )
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
        desired.joint_positions[:] = reference.joint_positions
        desired.joint_velocities[:] = reference.joint_velocities
        desired.joint_accelerations[:] = reference.joint_accelerations
        desired.quaternion[:] = reference.quaternion
        desired.omega_base[:] = reference.omega_base
        desired.alpha_base[:] = reference.alpha_base
        supervision.has_reference = 1.0
        return USABLE
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
