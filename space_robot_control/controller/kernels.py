"""Compiled kernels of a controller tick: signals, law, transfer, torque, allocation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.rho_space import force_for
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.lanes import uniform
from space_robot_msgs_py.compiled.records import Block

from ..laws.base import LawCode
from .signal_kernels import USABLE, compute_signals
from .tracking import torque_from_force

Array = NDArray[np.float64]


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
