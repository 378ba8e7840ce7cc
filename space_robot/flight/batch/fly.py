"""Many flights: those that can share a batch fly together, the others alone."""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Sequence
from contextlib import closing

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.errors import FlightError

from ..plan import Flight
from ..simulate import fly_blocks
from .batch import Batch, FlownBlock
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
    flights: Sequence[Flight], progress: Callable[[int], None] = lambda tick: None
) -> Generator[FlownBlock, None, None]:
    """Fly checked flights of one group of `batches`; yield their blocks as they are flown.

    The numbers in the blocks are places in ``flights``. What a flight raises is in its last block.
    """
    if len(flights) >= LEAST:
        yield from Batch(flights).fly(progress)
        return
    for number, flight in enumerate(flights):
        last: FlightLog | None = None
        with closing(fly_blocks(flight, progress=progress)) as blocks:
            try:
                for block in blocks:
                    if last is not None:
                        yield FlownBlock(number, last, None)
                    last = block
            except FlightError as error:
                if last is not None:
                    yield FlownBlock(number, last, error)
                continue
        if last is not None:
            yield FlownBlock(number, last, None)
