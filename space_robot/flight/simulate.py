"""Flights in this process, without ROS, with the same plant, mission and controller.

It is flown in blocks, so that one of any length needs the memory of one block (`fly_blocks`).
`simulate` is for those who need the whole flight as one log.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.law_choice import LawChoice
from space_robot_msgs_py.bag.flight_log import FlightLog, block_bounds, blocks_of
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.samples import LawInForce

from ..processes.scratch_folder import ScratchFolder
from .closed_loop import close_loop, measured_ticks
from .flight_messages import Messages, recording
from .flown_log import check_memory, empty_log, ended_early, note_assumed_errors
from .message_loop import MessageLoop
from .plan import Flight

Array = NDArray[np.float64]

STRETCH_TICKS, STRETCH_OF_MESSAGES = 10_000, 1_000
"""Ticks flown between two looks at the world outside: in compiled code, message by message."""


def fly_blocks(
    flight: Flight,
    bag: Path | None = None,
    progress: Callable[[int], None] = lambda tick: None,
    block_of: Callable[[int, int], FlightLog] | None = None,
) -> Generator[FlightLog, None, None]:
    """Fly every tick of ``flight`` and yield the logs, block by block.

    A flight that ends early hands out the block it ended in, up to the last state that was
    measured, before the error is raised; a state that was not answered has a command of NaN. All
    that was flown is then in the bag.

    A flight whose messages fail is handed out as its bag tells it, once it is over.

    Args:
        flight: a checked plan; its plant is flown on from where it stands.
        bag: where to write the messages the graph would have sent (None: nowhere).
        progress: called now and then with the ticks flown.
        block_of: the log to write the ticks from the first to before the second into, whose
            reference is filled in (None: a new one for every block).

    Raises:
        FlightError: the flight diverged or met a singular attitude; the bag is closed.
        InputError: the bag cannot be written, or the flight needs a graph of nodes.
    """
    flight.check_in_process()
    if flight.flies_by_messages:
        yield from _fly_by_messages(flight, bag, progress)
        return
    block_of = block_of or (lambda start, stop: empty_log(flight, start, stop))
    laws: tuple[LawInForce, ...] = ()
    choice = LawChoice(flight.law, flight.swaps)
    with recording(flight, bag) as messages:
        for start, stop in block_bounds(flight.ticks):
            block = block_of(start, stop)
            block.laws = laws
            try:
                _fly_block(flight, block, choice, messages, progress)
            except Exception as error:
                measured = measured_ticks(flight.plant, error)
                yield ended_early(block, measured - start, flight.plant.tick - start)
                raise
            yield block
            laws = block.laws
    progress(flight.ticks)


def simulate(
    flight: Flight, bag: Path | None = None, progress: Callable[[int], None] = lambda tick: None
) -> FlightLog:
    """Fly a flight into one log; see `fly_blocks`.

    Raises:
        FlightError: as there; its ``log`` is what was flown.
        InputError: as there, or a log of the whole flight would not fit into memory.
    """
    flight.check_in_process()
    if flight.flies_by_messages:
        return _flown_by_messages(flight, bag, progress)
    check_memory(flight, flight.ticks)
    log, flown = empty_log(flight), 0
    try:
        for block in fly_blocks(flight, bag, progress, log.rows):
            flown += block.ticks
            log.unanswered, log.laws = block.unanswered, block.laws
    except FlightError as error:
        error.log = log.rows(0, flown)
        raise
    return log


def _fly_by_messages(
    flight: Flight, bag: Path | None, progress: Callable[[int], None]
) -> Iterator[FlightLog]:
    try:
        log = _flown_by_messages(flight, bag, progress)
    except FlightError as error:
        if error.log:
            yield from blocks_of(error.log)
        raise
    yield from blocks_of(log)


def _flown_by_messages(
    flight: Flight, bag: Path | None, progress: Callable[[int], None]
) -> FlightLog:
    """Fly by `MessageLoop` into a bag, and read the bag."""
    with ScratchFolder() as folder:
        path = bag or Path(folder) / "bag"
        try:
            with recording(flight, path) as messages:
                assert messages
                loop = MessageLoop(flight, messages.record, messages.update_true_state)
                for tick in range(flight.plant.tick, flight.ticks):
                    if tick % STRETCH_OF_MESSAGES == 0:
                        progress(tick)
                    messages.begin_tick(tick)
                    messages.show(tick, lambda _: flight.plant.truth)
                    loop.fly_tick()
        except FlightError as error:
            error.log = read_flight(path, trust=True)
            raise
        progress(flight.ticks)
        return read_flight(path, trust=True)


def _fly_block(
    flight: Flight,
    block: FlightLog,
    choice: LawChoice,
    messages: Messages | None,
    progress: Callable[[int], None],
) -> None:
    plant, controller = flight.plant, flight.controller
    first, end = block.first_tick, block.first_tick + block.ticks
    swaps = {tick for tick, _ in flight.swaps if first <= tick < end}
    cuts = {*range(first, end, STRETCH_TICKS), *swaps, end}
    for start, stop in itertools.pairwise(sorted(cuts)):
        progress(start)
        if change := choice.change_at(start):
            controller.use(choice.chosen)
            block.laws += (change.law,)
        try:
            close_loop(plant, controller, block, start, stop)
        except Exception as error:
            note_assumed_errors(flight, block, start, plant.tick)
            if messages:
                messages.stretch(block, start, measured_ticks(plant, error), plant.tick)
            raise
        note_assumed_errors(flight, block, start, stop)
        if messages:
            messages.stretch(block, start, stop, stop)
