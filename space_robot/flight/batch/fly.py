"""Many flights: those that can share a batch fly together, the others alone."""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Sequence
from contextlib import closing

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.errors import FlightError

from ..plan import Flight
from ..simulate import fly_blocks, simulate
from .batch import FlightBatch, FlownBlock
from .sharing import batch_key, reason_to_fly_alone

LEAST = 2
"""Flights for which a batch is faster than one flight after the other."""


def batches(flights: Iterable[tuple[int, Flight]]) -> Iterator[list[tuple[int, Flight]]]:
    """Yield numbered flights in groups of up to eight that fly together, as soon as one is full."""
    waiting: dict[Hashable, list[tuple[int, Flight]]] = {}
    for number, flight in flights:
        if reason_to_fly_alone(flight):
            yield [(number, flight)]
            continue
        group = waiting.setdefault(batch_key(flight), [])
        group.append((number, flight))
        if len(group) == WIDTH:
            yield waiting.pop(batch_key(flight))
    yield from waiting.values()


def fly_group(
    flights: Sequence[Flight],
    progress: Callable[[int], None] = lambda tick: None,
    is_whole: bool = False,
    is_brief: bool = False,
) -> Generator[FlownBlock, None, None]:
    """Fly checked flights of one group of `batches`; yield their blocks as they are flown.

    The numbers in the blocks are places in ``flights``. The error that ended a flight is in its
    last block. ``is_whole``: each flight has one block. ``is_brief``: logs are for metrics, see
    `empty_log`.
    """
    if len(flights) >= LEAST:
        yield from FlightBatch(flights).fly(progress, is_whole, is_brief)
        return
    for number, flight in enumerate(flights):
        for log, error in _alone(flight, progress, is_whole):
            yield FlownBlock(number, log, error)


def _alone(
    flight: Flight, progress: Callable[[int], None], is_whole: bool
) -> Iterator[tuple[FlightLog, FlightError | None]]:
    last: FlightLog | None = None
    with closing(_blocks(flight, progress, is_whole)) as blocks:
        try:
            for block in blocks:
                if last is not None:
                    yield last, None
                last = block
        except FlightError as error:
            last = error.log if is_whole else last
            if last is None:
                raise
            yield last, error
            return
    if last is not None:
        yield last, None


def _blocks(
    flight: Flight, progress: Callable[[int], None], is_whole: bool
) -> Generator[FlightLog, None, None]:
    if is_whole:
        yield simulate(flight, progress=progress)
    else:
        yield from fly_blocks(flight, progress=progress)
