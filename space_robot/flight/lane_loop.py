"""The compiled loops of eight flights in lanes: under a law, and under torques from outside."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.signals import USABLE, compute_signals, copy_reference
from space_robot_control.controller.tick import apply_transfer
from space_robot_control.laws.base import LawCode
from space_robot_model.dynamics.rho_space import force_for
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.lanes import (
    WIDTH,
    any_lane,
    as_lanes,
    lane_of,
    negated,
    where,
    with_lane,
)
from space_robot_msgs_py.compiled.records import Block
from space_robot_sim.plant.lanes import advance_lanes, spread
from space_robot_sim.plant.tick import RATE_LIMIT
from space_robot_sim.sensors.sensors import sense


class InLanes(NamedTuple):
    """One kind of record of eight flights, in lanes and each by itself."""

    block: Block
    """(1,) in lanes."""
    numbers: Array
    """(N, 8): the same memory."""
    alone: Block
    """(8,): a record of each flight."""
    numbers_alone: Array
    """(8, N): the same memory."""


class LaneMemory(NamedTuple):
    """Memory of eight flights."""

    plants: InLanes
    """`PlantMemory`."""
    controllers: InLanes
    """`ControllerMemory`; the allocations in use are those of the flights by themselves."""
    measured: Block
    """(1,) `State` in lanes, of ``plants``."""
    reference: Block
    """(1,) `Reference` in lanes, of the tick."""
    reference_numbers: Array
    """(..., 8): the same memory."""
    command_delay_buffer: Array
    """(ticks, m+A, 8)."""
    torque: Array
    """(m+A, 8) last command of each flight, N m."""
    flies: Array
    """(1, 8): 1 for a lane whose flight goes on."""
    tick: Array
    """(1, 8): the tick that each flight has reached."""
    status: Array
    """(1, 8): of the last state of each flight, see `compute_signals`."""
    fastest: Array
    """(1, 8): `fastest_rate` of each flight, rad/s."""


class References(NamedTuple):
    """Desired motion of eight flights over some ticks."""

    numbers: Array
    """(M, N, ...): those of the `Reference` of each tick, of M missions."""
    missions: NDArray[np.int64]
    """(8,) mission of each lane."""


class LaneLog(NamedTuple):
    """Columns of a log of eight flights, (8, N, ...) each; see `FlightLog`."""

    truth: Any
    """Columns of true states, (8, N, c) each, in the order of `State`."""
    measured: Any
    """The same of measured states; without rows if they are the true ones."""
    places: NDArray[np.int64]
    """(2, ...) of the signals in `PlantMemory`: of true and of measured states."""
    commanded_torque: Array
    actuator_commands: Array
    telemetry: Array


@kernel
def fly_lanes(
    law: LawCode,
    allocate: RecordFunction,
    memory: LaneMemory,
    log: LaneLog,
    references: References,
    row: int,
    start: int,
    stop: int,
    period: float,
) -> int:
    """Fly from the tick ``start`` to ``stop``, or until no flight goes on.

    The sensors have measured ``start``, and not yet the tick reached, which is returned. The memory
    of a flight that ends is left in its record by itself, as it was then. ``law`` is in lanes, with
    ``h_bar`` (m, 8); ``log`` is filled from ``row`` on, where ``references`` has ``start``.
    """
    plant, controllers = memory.plants.block[0], memory.controllers.block
    buffer, torque = as_lanes(memory.command_delay_buffer), as_lanes(memory.torque)
    flies, ticks = as_lanes(memory.flies), as_lanes(memory.tick)
    statuses, rates = as_lanes(memory.status), as_lanes(memory.fastest)
    h_bar, signals, of_law = as_lanes(law.h_bar), controllers[0].signals, law.memory[0]
    for tick in range(start, stop):
        k = row + tick - start
        if tick > start:
            sense(plant.sensors, plant.truth, tick, period, plant.measured)
        _log_state(log.truth, k, log.places[0], memory.plants.numbers)
        if log.measured[0].shape[1] > 0:
            _log_state(log.measured, k, log.places[1], memory.plants.numbers)
        _refer(references, k, memory.reference_numbers)
        copy_reference(memory.reference[0], signals.reference)
        status = compute_signals(
            controllers, tick, memory.measured, h_bar, law.estimate, law.uses_model, period
        )
        is_flying = flies[0] == 1.0
        statuses[0] = where(is_flying, status, statuses[0])
        _end(memory, is_flying & (status != USABLE))
        is_flying = flies[0] == 1.0
        if not any_lane(is_flying):
            return tick
        law.run(signals, law.gains[0], of_law, period)
        if law.adds_inertia:
            force_for(signals.nominal, of_law.u, of_law.force, of_law.force)
        apply_transfer(controllers, tick, of_law.force, torque)
        if torque.size > of_law.force.size:
            _allocate(allocate, memory, is_flying, torque, of_law.force.size, tick)
        _log_command(log, k, torque, of_law.force.size)
        spread(of_law.s, log.telemetry[:, k, 0])
        spread(of_law.u, log.telemetry[:, k, 1])
        spread(signals.n_hat, log.telemetry[:, k, 2])
        spread(signals.error, log.telemetry[:, k, 3])
        fastest = advance_lanes(plant, memory.plants.alone, buffer, torque, tick, period, is_flying)
        rates[0] = where(is_flying, fastest, rates[0])
        ticks[0] = where(is_flying, tick + 1.0, ticks[0])
        _end(memory, is_flying & negated(fastest <= RATE_LIMIT))
        if not any_lane(flies[0] == 1.0):
            return tick + 1
    return stop


@kernel
def measure_lanes(plants: Block, tick: int, period: float) -> None:
    """Let the sensors of all plants of a block in lanes measure ``tick``."""
    for group in range(plants.size):
        memory = plants[group]
        sense(memory.sensors, memory.truth, tick, period, memory.measured)


@kernel
def _end(memory: LaneMemory, ends: bool) -> None:
    if not any_lane(ends):
        return
    for lane in range(WIDTH):
        if lane_of(ends, lane):
            memory.flies[0, lane] = 0.0
            take_out(memory.plants, lane)
            take_out(memory.controllers, lane)


@kernel
def take_out(records: InLanes, lane: int) -> None:
    """Copy the record of one lane into that of the flight by itself."""
    numbers, alone = records.numbers, records.numbers_alone
    for i in range(len(numbers)):
        alone[lane, i] = numbers[i, lane]


@kernel
def _refer(references: References, row: int, numbers: Array) -> None:
    for lane in range(WIDTH):
        desired = references.numbers[references.missions[lane], row]
        for i in range(desired.size):
            numbers[i, lane] = desired[i]


@kernel
def _log_state(columns: Any, row: int, places: NDArray[np.int64], numbers: Array) -> None:
    for k in range(len(places)):
        column = columns[k]
        for lane in range(WIDTH):
            for i in range(column.shape[2]):
                column[lane, row, i] = numbers[places[k] + i, lane]


@kernel
def _log_command(log: LaneLog, row: int, torque: Array, axes: int) -> None:
    spread(torque, log.commanded_torque[:, row])
    spread(torque[axes:], log.actuator_commands[:, row])


@kernel
def _allocate(
    allocate: RecordFunction,
    memory: LaneMemory,
    is_flying: bool,
    torque: Array,
    axes: int,
    tick: int,
) -> None:
    in_lanes = memory.controllers.block[0].allocation
    for lane in range(WIDTH):
        if lane_of(is_flying, lane):
            allocation = memory.controllers.alone[lane].allocation
            for i in range(3):
                allocation.demand[i] = lane_of(in_lanes.demand[i], lane)
            for i in range(in_lanes.reported_speeds.size):
                allocation.reported_speeds[i] = lane_of(in_lanes.reported_speeds[i], lane)
                allocation.reported_torques[i] = lane_of(in_lanes.reported_torques[i], lane)
            for i in range(3):
                of_lane = lane_of(in_lanes.torquers.magnetic_field[i], lane)
                allocation.torquers.magnetic_field[i] = of_lane
            allocate(allocation, float(tick))
            for i in range(axes, torque.size):
                torque[i] = with_lane(torque[i], lane, allocation.command[i - axes])


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
    """Fly 8 G plants, (G,) in lanes, from ``tick`` to the next, under ``torques`` (8 G, m+A).

    Args:
        plants: (G,) block of `PlantMemory` in lanes.
        alone: (8 G,) block of `PlantMemory`, in which a flight is integrated by itself.
        command_delay_buffers: (G, ticks, m+A, 8).
        torques: of each flight, N m.
        tick: at which they are given.
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
