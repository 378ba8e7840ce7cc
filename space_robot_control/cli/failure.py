"""A flight that ended before its time, as JSON: a script gets what there is, and the reason."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.errors import FlightError, InputError

if TYPE_CHECKING:
    from ..flight.plan import Flight

FLOWN = ("controller", "case", "gains", "robot", "mission", "sensors", "period", "swaps", "faults")


def failed_report(
    flight: Flight, bag: Path | None, error: FlightError, figures: dict[str, Any]
) -> dict[str, Any]:
    """Report what was to be flown, the ``figures`` of what was, and why it is no more."""
    from ..flight.ending import DIVERGED, Ending

    planned, ending = flight.description, Ending.early(error, flight.period)
    diverged = {"tick": ending.tick, "time_s": ending.ended_at_s}
    report = {key: planned[key] for key in FLOWN if key in planned}
    return {
        **report,
        **figures,
        "planned_ticks": flight.ticks,
        "bag": str(bag) if bag and bag.exists() else None,
        "diverged": diverged if ending.outcome == DIVERGED else None,
        "error": str(error),
        **ending.as_record(),
    }


def report_of(bag: Path) -> dict[str, Any]:
    """Report what a bag has of a flight that ended early; empty if it has not one whole tick."""
    from space_robot_msgs_py.bag.reader import read_flight

    from ..analysis import analyze

    try:
        return analyze(read_flight(bag, trust=True))
    except InputError:
        return {}
