"""What a flight was, and all its metrics, in one dictionary, ready for JSON."""

from __future__ import annotations

from typing import Any

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, laws_of
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from .analysed_log import AnalysedLog, PointingBudget, pointed_axis, pointing_of
from .described import actuators_of, event_labels, navigation_of, sensors_of, start_step_of
from .errors import UNAVAILABLE
from .measure import evaluate
from .sizing import ActuatorSet, load_requirements

DESCRIBED = ("controller", "case", "gains", "robot")
"""Keys of a flight's description that a report repeats."""


def analyze(
    log: FlightLog, actuators: ActuatorSet | None = None, budget: PointingBudget | None = None
) -> dict[str, Any]:
    """Compute the flight's report, the same from a graph flight, an in-process one, or a bag.

    ``metrics`` has all numbers by name; ``unavailable`` says why a group of them is missing. Of a
    flight with gaps (a broken bag) the longest stretch without one is analyzed; ``damage`` says so.

    Args:
        log: a flight.
        actuators: of the base, for the sizing; None: those that flew.
        budget: of the base's pointing; None: the default.

    Raises:
        InputError: no tick has both a state and a reference, or ``log`` is no flight.
    """
    if not isinstance(log, FlightLog):
        raise InputError(f"log: a FlightLog was expected (load_bag reads one), got {short(log)}")
    flight = AnalysedLog(_without_gaps(log), budget, actuators.settings if actuators else None)
    numbers, unavailable = evaluate(flight)
    if not flight.controls_base:
        unavailable = UNAVAILABLE | unavailable
    return {
        **_flown(flight, log.ticks),
        "pointing": _pointing(flight),
        "metrics": numbers,
        "sizing": None if "sizing" in unavailable else _sizing(flight, actuators, numbers),
        "unavailable": unavailable,
        **recording(flight.log),
    }


def _flown(flight: AnalysedLog, flight_ticks: int) -> dict[str, Any]:
    """Describe what was flown, and the part of it that is analyzed."""
    log, period_ns = flight.log, flight.log.timebase.period_ns
    laws, stop = laws_of(log), log.first_tick + log.ticks
    return {
        **{key: log.flight.get(key) for key in DESCRIBED},
        "faults": [str(fault) for fault in log.flight.get("faults", ())],
        "events": event_labels(log),
        **{k: log.flight[k] for k in ("own_gains",) if k in log.flight},
        **{k: str(log.flight[k]) for k in ("disturbance",) if k in log.flight},
        "start_step": start_step_of(log),
        "sensors": sensors_of(log),
        "navigation": navigation_of(log),
        "actuators": actuators_of(log),
        "truth_recorded": log.measured is not None,
        **({"controller": laws[0].name} if laws else {}),
        "laws": as_data(laws, log.timebase),
        "ticks": log.ticks,
        "flight_ticks": flight_ticks,
        "duration_s": log.ticks * period_ns / 1e9,
        "from_s": log.first_tick * period_ns / 1e9,
        "to_s": stop * period_ns / 1e9,
    }


def _pointing(flight: AnalysedLog) -> dict[str, Any] | None:
    """Describe what the base's pointing is measured against; None: nothing turns the base."""
    if not flight.controls_base:
        return None
    points = pointed_axis(*pointing_of(flight.log)) is not None
    return {"points": points, **flight.budget.model_dump()}


def _sizing(
    flight: AnalysedLog, other: ActuatorSet | None, numbers: dict[str, float]
) -> dict[str, Any]:
    """Judge whether the parts of actuators have what is asked of them; without parts: nothing."""
    name, settings = other or ActuatorSet(actuators_of(flight.log), flight.actuators)
    judged = [requirement.as_data() for requirement in load_requirements(settings, numbers)]
    return {"actuators": name, "flown": other is None, "requirements": judged}


def recording(log: FlightLog) -> dict[str, Any]:
    """Describe missing parts of a flight and damage of its bag."""
    return {
        "lost": log.lost,
        "unanswered_ticks": log.unanswered,
        "filled_ticks": log.filled,
        "unfinished": log.unfinished,
        "damage": list(log.damage),
    }


def _without_gaps(log: FlightLog) -> FlightLog:
    without_gaps = log.longest_stretch()
    if not without_gaps.ticks:
        raise InputError("no tick has both a state and a reference")
    if without_gaps.ticks < log.ticks:
        start, stop = without_gaps.time[0], without_gaps.time[-1]
        said = f"analyzed from t = {start:.4f} to {stop:.4f} s, the longest stretch without a gap"
        without_gaps.damage += (said,)
    return without_gaps
