"""Flights in this process, without ROS: the closed loop of plant and controller, and its log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from space_robot_control.controller.controller import Controller, unusable
from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.signals import USABLE
from space_robot_control.controller.tick import controller_tick
from space_robot_control.laws.base import CompiledLaw, LawCode
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.errors import DivergedError, FlightError
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.tick import RATE_LIMIT, advance
from space_robot_sim.sensors.sensors import sense

from ..processes.scratch_folder import ScratchFolder
from .flight_messages import MessageLoop, Messages, recording
from .flown_log import ended_early, flight_log, note_assumed_errors
from .plan import Flight
from .telemetry import live_telemetry, telemetry_of

STRETCH_TICKS, MESSAGE_STRETCH = 10_000, 1_000
"""Ticks flown between two reports of progress: in compiled code, message by message."""


def simulate(
    flight: Flight,
    bag: Path | None = None,
    progress: Callable[[int], None] = lambda tick: None,
    is_kept: bool = True,
) -> FlightLog:
    """Fly every tick of ``flight`` into one log, which lies in a file if it is large.

    A flight whose messages fail is returned as its bag tells it, once it is over.

    Args:
        flight: a checked plan; its plant is flown on from where it stands.
        bag: where to write the messages the graph would have sent (None: nowhere).
        progress: called now and then with the ticks flown.
        is_kept: False: the log is for a report only, and described by `Flight.brief`.

    Raises:
        FlightError: the flight diverged or met a singular attitude. Its ``log`` goes up to the last
            state that was measured; one that was not answered has a command of NaN.
        InputError: the bag cannot be written, the flight needs a graph of nodes, or there is no
            room for a log.
    """
    flight.check_in_process()
    if flight.flies_by_messages:
        return _flown_by_messages(flight, bag, progress)
    log = flight_log(flight, description=None if is_kept else flight.brief)
    choice = LawChoice(flight.law, flight.swaps)
    with recording(flight, bag) as messages, telemetry_of(flight) as send:
        try:
            _fly(flight, log, choice, messages, send, progress)
        except FlightError as error:
            error.log = ended_early(log, measured_ticks(flight.plant, error), flight.plant.tick)
            raise
    progress(flight.ticks)
    return log


def _flown_by_messages(
    flight: Flight, bag: Path | None, progress: Callable[[int], None]
) -> FlightLog:
    with ScratchFolder() as folder:
        path = bag or Path(folder) / "bag"
        try:
            with recording(flight, path) as messages, live_telemetry(flight) as report:
                assert messages
                update_truth = messages.update_true_state
                loop = MessageLoop(flight, messages.record, update_truth, report=report)
                for tick in range(flight.plant.tick, flight.ticks):
                    if tick % MESSAGE_STRETCH == 0:
                        progress(tick)
                    messages.begin_tick(tick)
                    messages.show(tick, lambda _: flight.plant.truth)
                    loop.fly_tick()
        except FlightError as error:
            error.log = _read(flight, path)
            raise
        progress(flight.ticks)
        return _read(flight, path)


def _read(flight: Flight, bag: Path) -> FlightLog:
    log = read_flight(bag, trust=True)
    log.scenario = flight.scenario
    return log


def _fly(
    flight: Flight,
    log: FlightLog,
    choice: LawChoice,
    messages: Messages | None,
    send: Callable[[FlightLog], None],
    progress: Callable[[int], None],
) -> None:
    plant, controller = flight.plant, flight.controller
    for start, stop in flight.stretches(STRETCH_TICKS):
        progress(start)
        if change := choice.change_at(start):
            controller.use(choice.chosen)
            log.laws += (change.law,)
        try:
            close_loop(plant, controller, log, start, stop)
        except Exception as error:
            note_assumed_errors(flight, log, start, plant.tick)
            if messages:
                messages.stretch(log, start, measured_ticks(plant, error), plant.tick)
            send(log.rows(start, plant.tick))
            raise
        note_assumed_errors(flight, log, start, stop)
        if messages:
            messages.stretch(log, start, stop, stop)
        send(log.rows(start, stop))


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
    """Count the states that ``plant`` had sent, the last one too unless it had diverged."""
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

    The sensors have measured ``start``, and not yet the tick reached, which is returned with the
    fastest rate there and the status of its state. ``state`` is what they measure of ``truth``;
    ``states``, ``torques``, ``telemetry`` and, unless empty, ``truths`` are filled, a row a tick.
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
