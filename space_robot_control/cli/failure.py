"""A flight that ended before its time, as JSON: a script gets what there is, and the reason."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.errors import DivergedError, FlightError, InputError

if TYPE_CHECKING:
    from ..flight.plan import Flight

FLOWN = ("controller", "case", "gains", "robot", "mission", "period", "swaps", "faults")
_DIVERGED = re.compile(r"diverged at tick (\d+)")


@contextmanager
def told_as_json(flight: Flight, bag: Path | None, as_json: bool) -> Iterator[None]:
    """Print the report of a flight that raises; with the figures of its bag, if it has any."""
    try:
        yield
    except FlightError as error:
        if as_json:
            from ..flight.terminal import echo_json

            echo_json(failed_report(flight, bag, error, _figures(bag)))
        raise


def failed_report(
    flight: Flight, bag: Path | None, error: FlightError, figures: dict[str, Any]
) -> dict[str, Any]:
    """Report what was to be flown, the ``figures`` of what was, and why it is no more."""
    planned = flight.description
    report = {key: planned[key] for key in FLOWN if key in planned}
    return {
        **report,
        **figures,
        "planned_ticks": flight.ticks,
        "bag": str(bag) if bag and bag.exists() else None,
        "diverged": _divergence(error, flight.period),
        "error": str(error),
    }


def _figures(bag: Path | None) -> dict[str, Any]:
    from space_robot_msgs_py.bag.reader import read_flight

    from ..analysis import analyze

    if bag is None or not bag.exists():
        return {}
    try:
        return analyze(read_flight(bag, trust=True))
    except InputError:  # it has not one whole tick
        return {}


def _divergence(error: FlightError, period: float) -> dict[str, Any] | None:
    """Tick and time; of a graph's flight they are in the words of the node that saw it."""
    found = _DIVERGED.search(str(error))
    tick = error.tick if isinstance(error, DivergedError) else int(found[1]) if found else None
    return None if tick is None else {"tick": tick, "time_s": round(tick * period, 9)}
