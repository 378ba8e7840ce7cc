"""Closed loop of plant and controller in one process, logged tick by tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.controller import Controller, unusable
from space_robot_control.controller.signals import USABLE
from space_robot_control.controller.tick import controller_tick
from space_robot_control.laws.base import CompiledLaw, LawCode
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.errors import DivergedError
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.tick import RATE_LIMIT, advance
from space_robot_sim.sensors.sensors import sense

Array = NDArray[np.float64]


def close_loop(plant: Plant, controller: Controller, log: FlightLog, start: int, stop: int) -> None:
    """Fly the ticks ``start`` to ``stop``, all of them in ``log``, whose reference is filled in.

    A law with a kernel runs in compiled code, any other at the speed of Python. Both run the
    same kernels, as the nodes do.

    Raises:
        FlightError: the flight diverged or met a state that no command answers. What was flown
            up to there is in ``log``, see `measured_ticks`.
    """
    law, rows = controller.law, log.rows(start - log.first_tick, stop - log.first_tick)
    if not isinstance(law, CompiledLaw):
        _close_loop_in_python(plant, controller, rows)
        return
    while start < stop:
        end = int(min(stop, plant.next_change))
        _close_loop_compiled(plant, controller, law, log, start, end)
        start = end


def _close_loop_compiled(
    plant: Plant, controller: Controller, law: CompiledLaw, log: FlightLog, start: int, stop: int
) -> None:
    """Fly ticks that need only compiled code, and begin ``stop``."""
    rows = log.rows(start - log.first_tick, stop - log.first_tick)
    assert rows.telemetry is not None
    states = np.empty(rows.ticks, plant.state.block.dtype)
    torques = np.zeros((rows.ticks, len(controller.names.commanded)))
    truths = np.empty(0 if rows.measured is None else rows.ticks, states.dtype)
    tick, fastest, status = fly_ticks(
        law.code,
        controller.allocate,
        plant.block,
        plant.command_delay_buffer,
        controller.block,
        plant.state.block,
        plant.truth.block,
        rows.references(start, stop),
        states,
        truths,
        torques,
        rows.telemetry,
        start,
        plant.period,
    )
    measured = tick - start + (status != USABLE)
    rows.put(start, states[:measured] if rows.measured is None else truths[:measured])
    rows.put_measured(start, states[:measured])
    rows.put_commands(start, torques)
    plant.state.tick = plant.truth.tick = tick
    if status != USABLE:
        raise unusable(status, tick, plant.state.quaternion)
    if not fastest <= RATE_LIMIT:
        raise plant.diverged(fastest)
    plant.begin_tick(tick)


def measured_ticks(plant: Plant, error: Exception) -> int:
    """Count the states ``plant`` had sent when `close_loop` raised ``error``.

    A state that the law could not answer was sent; a state that the plant rejected as diverged
    was not. `Plant.tick` is the number of answered states.
    """
    return plant.tick + (not isinstance(error, DivergedError))


def _close_loop_in_python(plant: Plant, controller: Controller, log: FlightLog) -> None:
    assert log.telemetry is not None
    for row in range(log.ticks):
        tick = log.first_tick + row
        log.put(tick, plant.state.block if log.measured is None else plant.truth.block)
        log.put_measured(tick, plant.state.block)
        command = controller.update(plant.state, log.references(tick, tick + 1))
        log.put_commands(tick, command.torque[np.newaxis])
        log.telemetry[row] = controller.telemetry()
        plant.step(command)


@kernel
def fly_ticks(
    law: LawCode,
    allocate: RecordFunction,
    plant_block: Block,
    command_delay_buffer: Array,
    controller_block: Block,
    state: Block,
    truth: Block,
    references: Block,
    states: Block,
    truths: Block,
    torques: Array,
    telemetry: Array,
    start: int,
    period: float,
) -> tuple[int, float, int]:
    """Fly from the tick ``start`` on, a tick for each reference; the loop of `close_loop`.

    The sensors have measured ``start``, and not yet the tick reached. ``state`` is what they
    measure of ``truth``; ``states``, ``torques`` and ``telemetry`` are filled, a row a tick, and
    ``truths``, unless it is empty.

    Returns:
        The tick reached, the fastest rate there, and the status of its state.
    """
    plant, fastest = plant_block[0], 0.0
    for k in range(references.size):
        tick, torque, signals_row = start + k, torques[k], telemetry[k]
        if k > 0:
            sense(plant.sensors, plant.truth, tick, period, plant.measured)
        states[k] = state[0]
        if truths.size > 0:
            truths[k] = truth[0]
        status = controller_tick(
            controller_block, law, allocate, tick, state, references[k : k + 1], torque, period
        )
        if status != USABLE:
            return tick, fastest, status
        signals = controller_block[0].signals
        signals_row[0], signals_row[1] = law.memory[0].s, law.memory[0].u
        signals_row[2], signals_row[3] = signals.n_hat, signals.error
        fastest = advance(plant, command_delay_buffer, torque, tick, period)
        if not fastest <= RATE_LIMIT:
            return tick + 1, fastest, USABLE
    return start + references.size, fastest, USABLE
