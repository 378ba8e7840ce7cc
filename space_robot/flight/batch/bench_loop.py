"""A tick of many plants under torques from outside, in compiled code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lane_words import as_lanes
from space_robot_msgs_py.compiled.lanes import WIDTH, lane_of
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import State
from space_robot_sim.plant.lanes import advance_lanes
from space_robot_sim.plant.plant import RATE_LIMIT
from space_robot_sim.sensors.sensors import sense

Array = NDArray[np.float64]


@kernel
def fly_benches(
    plants: Block,
    alone: Block,
    command_delay_buffers: Array,
    torques: Array,
    tick: int,
    period: float,
    flies: Array,
    fastest: Array,
    goes_on: bool,
    measured: Array,
    true: Array,
) -> None:
    """Fly 8 G plants from ``tick`` to the next.

    Args:
        plants: (G,) block of `PlantMemory` in lanes.
        alone: (8 G,) block of `PlantMemory`, in which a flight is integrated by itself.
        command_delay_buffers: (G, ticks, m+A, 8).
        torques: (8 G, m+A) command of each flight.
        tick: at which it is given.
        period: s.
        flies: (8 G,) 1 for a flight that goes on; set to 0 if it has diverged.
        fastest: (8 G,) set to the `fastest_rate` of each plant, rad/s.
        goes_on: the sensors are to measure the next tick at once.
        measured: (8 G, ...) numbers of a `State`, set for flights that go on.
        true: (8 G, ...) the same of the true states.
    """
    numbers = np.zeros((torques.shape[1], WIDTH))
    flying = np.zeros((1, WIDTH))
    for group in range(plants.size):
        first = WIDTH * group
        for lane in range(WIDTH):
            flying[0, lane] = flies[first + lane]
            for i in range(len(numbers)):
                numbers[i, lane] = torques[first + lane, i]
        rate = advance_lanes(
            plants[group],
            alone[first : first + WIDTH],
            as_lanes(command_delay_buffers[group]),
            as_lanes(numbers),
            tick,
            period,
            as_lanes(flying)[0] == 1.0,
        )
        _copy(plants[group].truth, flies[first : first + WIDTH], true[first : first + WIDTH])
        for lane in range(WIDTH):
            fastest[first + lane] = lane_of(rate, lane)
    if goes_on:
        measure_benches(plants, tick + 1, period, flies, measured, true)
    for k in range(len(flies)):
        if flies[k] == 1.0 and not fastest[k] <= RATE_LIMIT:
            flies[k] = 0.0


@kernel
def measure_benches(
    plants: Block, tick: int, period: float, flies: Array, measured: Array, true: Array
) -> None:
    """Let the sensors measure ``tick``, see `fly_benches`."""
    for group in range(plants.size):
        memory, eight = plants[group], slice(WIDTH * group, WIDTH * (group + 1))
        if tick > 0:
            sense(memory.sensors, memory.truth, tick, period, memory.measured)
        _copy(memory.truth, flies[eight], true[eight])
        _copy(memory.measured, flies[eight], measured[eight])


@kernel
def _copy(state: State, flies: Array, rows: Array) -> None:
    """Copy a state in lanes into a row of numbers for each flight that goes on."""
    at = _copy_field(state.base_position, flies, rows, 0)
    at = _copy_field(state.quaternion, flies, rows, at)
    at = _copy_field(state.base_velocity, flies, rows, at)
    at = _copy_field(state.omega_base, flies, rows, at)
    at = _copy_field(state.joint_positions, flies, rows, at)
    at = _copy_field(state.joint_velocities, flies, rows, at)
    at = _copy_field(state.applied_torque, flies, rows, at)
    at = _copy_field(state.wheel_velocities, flies, rows, at)
    at = _copy_field(state.wheel_torques, flies, rows, at)
    at = _copy_field(state.thrusts, flies, rows, at)
    at = _copy_field(state.passive_positions, flies, rows, at)
    _copy_field(state.passive_velocities, flies, rows, at)


@subroutine
def _copy_field(values: Array, flies: Array, rows: Array, at: int) -> int:
    """Copy a field into the columns from ``at`` on; return the column after it."""
    for i in range(values.size):
        value = values[i]
        for lane in range(WIDTH):
            if flies[lane] == 1.0:
                rows[lane, at + i] = lane_of(value, lane)
    return at + values.size
