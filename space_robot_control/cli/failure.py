"""A flight that ended before its time, as JSON: a script gets what there is, and the reason."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.errors import DivergedError, FlightError, InputError

if TYPE_CHECKING:
    from ..flight.plan import Flight

FLOWN = ("controller", "case", "gains", "robot", "mission", "sensors", "period", "swaps", "faults")
_DIVERGED = re.compile(r"diverged at tick (\d+)")


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


def report_of(bag: Path) -> dict[str, Any]:
    """Report what a bag has of a flight that ended early; empty if it has not one whole tick."""
    from space_robot_msgs_py.bag.reader import read_flight

    from ..analysis import analyze

    try:
        return analyze(read_flight(bag, trust=True))
    except InputError:
        return {}


def _divergence(error: FlightError, period: float) -> dict[str, Any] | None:
    """Return tick and time; of a graph's flight they are in the words of the node that saw it."""
    found = _DIVERGED.search(str(error))
    tick = error.tick if isinstance(error, DivergedError) else int(found[1]) if found else None
    return None if tick is None else {"tick": tick, "time_s": round(tick * period, 9)}
