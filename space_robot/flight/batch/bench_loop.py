"""A tick of many plants under torques from outside, in compiled code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import WIDTH, as_lanes, lane_of
from space_robot_msgs_py.compiled.records import Block
from space_robot_sim.plant.lanes import advance_lanes
from space_robot_sim.plant.tick import RATE_LIMIT

from .lane_loop import measure_lanes

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
        for lane in range(WIDTH):
            fastest[first + lane] = lane_of(rate, lane)
    if goes_on:
        measure_lanes(plants, tick + 1, period)
    for k in range(len(flies)):
        if flies[k] == 1.0 and not fastest[k] <= RATE_LIMIT:
            flies[k] = 0.0
