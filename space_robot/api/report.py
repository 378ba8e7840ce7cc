"""Report of a flight, its metrics and outcome, as data for JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..flight.ending import DIVERGED, Ending
from ..flight.plan import Flight

FLOWN = (
    "controller",
    "case",
    "gains",
    "own_gains",
    "robot",
    "mission",
    "sensors",
    "period",
    "swaps",
    "faults",
    "events",
    "disturbance",
)


def flight_report(
    flight: Flight, ending: Ending, metrics: dict[str, Any], bag: Path | None
) -> dict[str, Any]:
    """Return the ``metrics`` of a flight with ``outcome``, ``reason`` and ``ended_at_s``.

    For a flight that ended early also its description, as far as it is not in ``metrics``,
    ``planned_ticks``, ``bag`` (None if there is none), ``error`` and, if it ``diverged``, the tick
    and time.
    """
    if ending.error is None:
        return metrics | ending.as_record()
    planned, diverged = flight.description, {"tick": ending.tick, "time_s": ending.ended_at_s}
    return {
        **{key: planned[key] for key in FLOWN if key in planned},
        **metrics,
        "planned_ticks": flight.ticks,
        "bag": str(bag) if bag and bag.exists() else None,
        "diverged": diverged if ending.outcome == DIVERGED else None,
        "error": ending.reason,
        **ending.as_record(),
    }
