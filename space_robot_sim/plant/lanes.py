"""Plants of eight flights, stepped together.

Over most steps every joint slides or stands all through, so that all flights take the same course
(`integrator.regular_step`). A flight in which a joint stops or breaks away is integrated by itself
over that step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import (
    WIDTH,
    all_lanes,
    lane_of,
    negated,
    uniform,
    where,
    whole,
    with_lane,
)
from space_robot_msgs_py.compiled.records import Block

from ..environment.environment import Environment
from .integrator import integrate, regular_step, state_size
from .tick import PlantMemory, begin_interval, end_interval

Array = NDArray[np.float64]


@kernel
def advance_lanes(
    memory: PlantMemory,
    alone: Block,
    command_delay_buffer: Array,
    torque: Array,
    tick: int,
    period: float,
    flies: bool,
) -> float:
    """Fly eight plants from ``tick`` to the next under a ``torque`` each, see `advance`.

    All are in lanes but ``alone``, a block (8,) in which a flight is integrated by itself.
    ``flies`` is the mask of the lanes that count.
    """
    begin_interval(memory, command_delay_buffer, torque, tick, period)
    move_lanes(memory, alone, tick * period, period, flies)
    fastest: float = end_interval(memory, tick + 1, period)
    return fastest


@kernel
def move_lanes(memory: PlantMemory, alone: Block, start: float, period: float, flies: bool) -> None:
    """Integrate the states of the flights that fly over a tick that begins at ``start``, s.

    ``start`` may be of each lane.
    """
    model, x, stages = memory.model, memory.x, memory.stages
    substeps = whole(memory.substeps)
    step = period / substeps
    for k in range(substeps):
        time = start + k * step
        goes_on = regular_step(model, memory.environment, x, time, step, stages)
        moves = goes_on & flies
        for i in range(state_size(model, memory.environment)):
            x[i] = where(moves, stages.end[i], x[i])
        if not all_lanes(goes_on | negated(flies)):
            for lane in range(WIDTH):
                if lane_of(flies, lane) and not lane_of(goes_on, lane):
                    _move_alone(memory, alone[lane], lane, lane_of(time, lane), step)


@kernel
def _move_alone(
    memory: PlantMemory, alone: PlantMemory, lane: int, time: float, step: float
) -> None:
    """Integrate the flight of one lane over a step."""
    # of its block only what changed since is copied: state, actuation, what acts over the tick
    x, stages = memory.x, alone.stages
    actuation = memory.stages.actuation
    for i in range(state_size(alone.model, alone.environment)):
        alone.x[i] = lane_of(x[i], lane)
    for i in range(6 + whole(alone.environment.friction.count)):
        stages.actuation[i] = lane_of(actuation[i], lane)
    _hold_alone(memory.environment, alone.environment, whole(alone.model.joint_count) + 1, lane)
    integrate(alone.model, alone.environment, alone.x, time, step, stages)
    for i in range(state_size(alone.model, alone.environment)):
        x[i] = with_lane(x[i], lane, alone.x[i])


@subroutine
def _hold_alone(in_lanes: Environment, alone: Environment, bodies: int, lane: int) -> None:
    """Copy what acts over a tick to the flight of one lane: of the orbit, of the user's own."""
    if uniform(in_lanes.loads.is_on) != 0.0:
        alone.loads.begin[0] = lane_of(in_lanes.loads.begin[0], lane)
        for k in range(6):
            alone.loads.actuation[k] = lane_of(in_lanes.loads.actuation[k], lane)
        for i in range(alone.loads.value.size):
            alone.loads.value[i] = lane_of(in_lanes.loads.value[i], lane)
            alone.loads.slope[i] = lane_of(in_lanes.loads.slope[i], lane)
    for k in range(3):
        alone.orbit.magnetic_torque[k] = lane_of(in_lanes.orbit.magnetic_torque[k], lane)
    if uniform(in_lanes.surfaces.count) > 0.0:
        for i in range(bodies):
            for k in range(6):
                wrench = lane_of(in_lanes.surfaces.wrench[i, k], lane)
                alone.surfaces.wrench[i, k] = wrench


@subroutine
def spread(values: Array, rows: Array) -> None:
    """Write the first c ``values``, in lanes, into ``rows`` (8, c), one of each flight."""
    for i in range(rows.shape[1]):
        value = values[i]
        for lane in range(WIDTH):
            rows[lane, i] = lane_of(value, lane)
