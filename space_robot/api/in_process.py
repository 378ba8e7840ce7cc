"""Flights in this process, for `Scenario.fly` and ``simulate``."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from space_robot_msgs_py.errors import FlightError

from ..analysis import Analysis
from ..console.progress import flight_progress
from ..flight.bag_path import check_bag_path
from ..flight.compilation import compile_kernels
from ..flight.ending import Ending
from ..flight.plan import Flight
from ..flight.simulate import fly_blocks, simulate
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
        InputError: the bag cannot be created, or memory is too small for a log.
    """
    flight.check_in_process()
    if bag:
        check_bag_path(bag)
    compile_kernels(bool(flight.plant.names.actuators))

    def show(tick: int) -> None:
        if progress:
            progress(tick * flight.period)

    fly = _into_a_log if keep_log else _into_metrics
    return fly(flight, bag, show)


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


def _into_a_log(flight: Flight, bag: Path | None, show: Callable[[int], None]) -> FlownFlight:
    try:
        log, ending = simulate(flight, bag, show), _complete(flight)
    except FlightError as error:
        if error.log is None:
            raise
        log, ending = error.log, Ending.early(error, flight.period)
    return FlownFlight(flight, ending, bag, log)


def _into_metrics(flight: Flight, bag: Path | None, show: Callable[[int], None]) -> FlownFlight:
    """Fly and keep only the metrics; memory holds one block."""
    analysis, ending = Analysis(), _complete(flight)
    with closing(fly_blocks(flight, bag, show)) as blocks:
        try:
            for block in blocks:
                analysis.add(block)
        except FlightError as error:
            ending = Ending.early(error, flight.period)
    return FlownFlight(flight, ending, bag, None, analysis.report() if analysis.ticks else {})


def _complete(flight: Flight) -> Ending:
    return Ending.complete(flight.ticks, flight.period)
