"""Flights in this process, for `Scenario.fly` and ``simulate``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from space_robot_msgs_py.errors import FlightError

from ..console.progress import flight_progress
from ..flight.bag_path import check_bag_path
from ..flight.compilation import compile_kernels
from ..flight.ending import Ending
from ..flight.plan import Flight
from ..flight.simulate import simulate
from .flown_flight import FlownFlight


def fly_in_process(
    flight: Flight,
    bag: Path | None = None,
    progress: Callable[[float], object] | None = None,
    keep_log: bool = True,
) -> FlownFlight:
    """Fly a checked flight from the present state of its plant.

    Args:
        flight: to be flown.
        bag: folder to record to; None: none.
        progress: called regularly with the simulated time, s.
        keep_log: False: only the metrics are kept.

    Raises:
        InputError: the bag cannot be created, or there is no room for a log.
    """
    flight.check_in_process()
    if bag:
        check_bag_path(bag)
    compile_kernels(bool(flight.plant.names.actuators))

    def show(tick: int) -> None:
        if progress:
            progress(tick * flight.period)

    try:
        log, ending = simulate(flight, bag, show), Ending.complete(flight.ticks, flight.period)
    except FlightError as error:
        if error.log is None:
            raise
        log, ending = error.log, Ending.early(error, flight.period)
    return FlownFlight(flight, ending, bag, log, keep_log)


def fly_with_progress(
    flight: Flight,
    bag: Path | None,
    progress: Callable[[float], object] | bool | None,
    keep_log: bool,
) -> FlownFlight:
    """Fly as `fly_in_process` does; ``progress`` True shows a progress line.

    Raises:
        InputError: see `fly_in_process`.
    """
    if progress is not True:
        return fly_in_process(flight, bag, progress or None, keep_log)
    _ = flight.supervisor  # compiled, or refused, before the line begins
    compile_kernels(bool(flight.plant.names.actuators))  # has a progress line of its own
    with flight_progress(flight.ticks * flight.period, flight.law.name) as show:
        return fly_in_process(flight, bag, show, keep_log)
