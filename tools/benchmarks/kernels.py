"""Loops in compiled code around what is measured, as it is called in a flight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.tick import NEW, answer_state, controller_tick, judge_stamp
from space_robot_control.laws.base import LawCode
from space_robot_model.dynamics.aba import aba
from space_robot_model.dynamics.kinematics import forward_kinematics, spatial_velocities
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.lanes import as_lanes
from space_robot_msgs_py.compiled.records import Block
from space_robot_sim.plant.lanes import advance_lanes
from space_robot_sim.plant.tick import advance

Array = NDArray[np.float64]


@kernel
def plant_steps(
    block: Block, command_delay_buffer: Array, torque: Array, tick: int, steps: int, period: float
) -> float:
    """Steps of a `Plant` from ``tick`` on under one torque; returns the fastest rate at the end."""
    memory, fastest = block[0], 0.0
    for k in range(tick, tick + steps):
        fastest = advance(memory, command_delay_buffer, torque, k, period)
    return fastest


@kernel
def lane_steps(
    block: Block,
    alone: Block,
    command_delay_buffer: Array,
    torque: Array,
    steps: int,
    period: float,
) -> None:
    """Steps of eight plants in lanes under one torque."""
    buffer, command = as_lanes(command_delay_buffer), as_lanes(torque)
    memory = block[0]
    flies = memory.x[3] == memory.x[3]
    for k in range(steps):
        advance_lanes(memory, alone, buffer, command, k, period, flies)


@kernel
def forward_dynamics_calls(block: Block, force: Array, calls: int) -> None:
    """``qdd = H^-1 (F - c)`` in the state of a `Plant`; ``force`` (n+6+MOST_WHEELS,)."""
    memory = block[0]
    x, stages, n = memory.x, memory.stages, memory.measured.joint_positions.size
    data, out = stages.data, stages.slope[0, 7 + n :]
    for _ in range(calls):
        forward_kinematics(memory.model, x[3:7], x[7 : 7 + n], data)
        spatial_velocities(memory.model, x[10 + n : 13 + n], x[13 + n :], data)
        aba(memory.model, x[10 + n : 13 + n], x[13 + n :], force, data, out)
        force[0] = 1e-12 * out[0]  # the next call waits for this one


@kernel
def controller_ticks(
    law: LawCode,
    allocate: RecordFunction,
    block: Block,
    states: Block,
    references: Block,
    ticks: int,
    torque: Array,
    period: float,
) -> None:
    """All that an on-board computer does in a tick, over the rows of a recorded flight."""
    for i in range(ticks):
        k = i % states.size
        controller_tick(
            block, law, allocate, k, states[k : k + 1], references[k : k + 1], torque, period
        )


@kernel
def answered_states(
    supervision: Block,
    controller: Block,
    law: LawCode,
    allocate: RecordFunction,
    states: Block,
    references: Block,
    period: float,
) -> None:
    """What the flight software answers to states, from tick 0 on."""
    for k in range(states.size):
        if judge_stamp(supervision, k) == NEW:
            state, reference = states[k : k + 1], references[k : k + 1]
            answer_state(supervision, controller, law, allocate, k, state, reference, period)
