"""Flights in this process, without ROS, with the same plant, mission and controller."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from space_robot_control.controller.law_choice import LawChoice
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError

from ..processes.scratch_folder import ScratchFolder
from .closed_loop import close_loop, measured_ticks
from .flight_messages import MessageLoop, Messages, recording
from .flown_log import ended_early, flight_log, note_assumed_errors
from .plan import Flight

STRETCH_TICKS, STRETCH_OF_MESSAGES = 10_000, 1_000
"""Ticks flown between two looks at the world outside: in compiled code, message by message."""


def simulate(
    flight: Flight, bag: Path | None = None, progress: Callable[[int], None] = lambda tick: None
) -> FlightLog:
    """Fly every tick of ``flight`` into one log, which lies in a file if it is large.

    A flight whose messages fail is returned as its bag tells it, once it is over.

    Args:
        flight: a checked plan; its plant is flown on from where it stands.
        bag: where to write the messages the graph would have sent (None: nowhere).
        progress: called now and then with the ticks flown.

    Raises:
        FlightError: the flight diverged or met a singular attitude; the bag is closed. Its ``log``
            is what was flown, up to the last state that was measured; a state that was not answered
            has a command of NaN.
        InputError: the bag cannot be written, the flight needs a graph of nodes, or there is no
            room for a log.
    """
    flight.check_in_process()
    if flight.flies_by_messages:
        return _flown_by_messages(flight, bag, progress)
    log = flight_log(flight)
    choice = LawChoice(flight.law, flight.swaps)
    with recording(flight, bag) as messages:
        try:
            _fly(flight, log, choice, messages, progress)
        except FlightError as error:
            error.log = ended_early(log, measured_ticks(flight.plant, error), flight.plant.tick)
            raise
    progress(flight.ticks)
    return log


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
            raise
        note_assumed_errors(flight, log, start, stop)
        if messages:
            messages.stretch(log, start, stop, stop)
