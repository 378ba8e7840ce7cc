"""What a flight was and all its metrics: a dictionary ready for JSON, and a page of several."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, laws_of
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..console.tables import Column, JudgedCell, Table
from .analysed_log import AnalysedLog, PointingBudget
from .described import event_labels, flown_name, recorded_start_step
from .errors import UNAVAILABLE
from .measure import evaluate
from .report_tables import comparison_table, sizing_table
from .series import GROUPS
from .sizing import ActuatorSet, load_requirements
from .words import WARNING_GROUPS, Report, law_text, notes, remarks, warnings

if TYPE_CHECKING:
    import jinja2

IN_BRIEF = ("errors", "drift", "navigation", "roughness", *WARNING_GROUPS)
"""Groups of metrics that `rms_table`, its remarks and `warnings` show of any flight."""
DESCRIBED = ("controller", "case", "gains", "robot")
"""Keys of a flight's description that a report repeats."""


def analyze(
    log: FlightLog,
    actuators: ActuatorSet | None = None,
    budget: PointingBudget | None = None,
    in_brief: bool = False,
) -> dict[str, Any]:
    """Compute the flight's report, the same from a graph flight, an in-process one, or a bag.

    ``metrics`` has all numbers by name; ``unavailable`` says why a group of them is missing. Of a
    flight with gaps (a broken bag) the longest stretch without one is analyzed; ``damage`` says so.

    Args:
        log: a flight.
        actuators: of the base, for the sizing; None: those that flew.
        budget: of the base's pointing; None: the default.
        in_brief: True: without the metrics that the terminal does not show after a flight.

    Raises:
        InputError: no tick has both a state and a reference, or ``log`` is no flight.
    """
    if not isinstance(log, FlightLog):
        raise InputError(f"log: a FlightLog was expected (load_bag reads one), got {short(log)}")
    flight = AnalysedLog(_without_gaps(log), budget, actuators.settings if actuators else None)
    groups = _in_brief(flight) if in_brief else GROUPS
    numbers, unavailable = evaluate(flight, groups=groups)
    pointing = None
    if flight.controls_base:
        pointing = {"points": flight.pointed_axis is not None, **flight.budget.model_dump()}
    else:
        unavailable = UNAVAILABLE | unavailable
    is_sized = "sizing" in groups and "sizing" not in unavailable
    return {
        **_flown(flight, log.ticks),
        "pointing": pointing,
        "metrics": numbers,
        "sizing": _sizing(flight, actuators, numbers) if is_sized else None,
        "warnings": warnings(numbers),
        "unavailable": unavailable,
        **recording(flight.log),
    }


def _in_brief(flight: AnalysedLog) -> list[str]:
    log = flight.log
    conditions = {
        "sizing": log.wheel_velocities.shape[1] or log.thrusts.shape[1],
        "steadiness": flight.pointed_axis is not None,
        "missed_captures": "events" in log.flight,
    }
    return [*IN_BRIEF, *(name for name, is_shown in conditions.items() if is_shown)]


def _flown(flight: AnalysedLog, flight_ticks: int) -> dict[str, Any]:
    log, period_ns = flight.log, flight.log.timebase.period_ns
    laws, stop = laws_of(log), log.first_tick + log.ticks
    return {
        **{key: log.flight.get(key) for key in DESCRIBED},
        "faults": [str(fault) for fault in log.flight.get("faults", ())],
        "events": event_labels(log),
        **{k: log.flight[k] for k in ("own_gains",) if k in log.flight},
        **{k: str(log.flight[k]) for k in ("disturbance",) if k in log.flight},
        "start_step": recorded_start_step(log),
        **{key: flown_name(log, key) for key in ("sensors", "navigation", "actuators")},
        "truth_recorded": log.measured is not None,
        **({"controller": laws[0].name} if laws else {}),
        "laws": as_data(laws, log.timebase),
        "ticks": log.ticks,
        "flight_ticks": flight_ticks,
        "duration_s": log.ticks * period_ns / 1e9,
        "from_s": log.first_tick * period_ns / 1e9,
        "to_s": stop * period_ns / 1e9,
    }


def _sizing(
    flight: AnalysedLog, other: ActuatorSet | None, numbers: dict[str, float]
) -> dict[str, Any]:
    name, settings = other or ActuatorSet(flown_name(flight.log, "actuators"), flight.actuators)
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


def render(
    reports: Mapping[str, Report],
    descriptions: Mapping[str, dict[str, Any]],
    figures: Sequence[tuple[str, str]],
) -> str:
    """Render a page of one flight or several, without references to anything outside itself.

    Args:
        reports: of `analyze`, by name of the bag.
        descriptions: what was flown, as the bags have it.
        figures: caption and data URI of each.
    """
    return template("space_robot.analysis", "flights.html.j2").render(
        names=list(reports),
        recorded=_recorded(reports),
        metrics=comparison_table(reports),
        sizing={name: table for name, r in reports.items() if (table := sizing_table(r))},
        notes={name: [*remarks(r), *notes(r)] for name, r in reports.items()},
        descriptions={name: json.dumps(d, indent=1) for name, d in descriptions.items()},
        figures=figures,
    )


def _recorded(reports: Mapping[str, Report]) -> Table:
    names = ("bag", "law", "case", "gains", "robot", "time analysed", "ticks", "recording")
    rows = [
        [
            name,
            law_text(report) or "not said",
            *(report[key] or "not said" for key in ("case", "gains", "robot")),
            f"{report['from_s']:g} to {report['to_s']:g} s",
            report["ticks"]
            if report["ticks"] == report["flight_ticks"]
            else f"{report['ticks']} of {report['flight_ticks']}",
            JudgedCell.of(_is_whole(report), "whole", "not whole"),
        ]
        for name, report in reports.items()
    ]
    return Table.of("", [Column(name) for name in names], rows)


def _is_whole(report: Report) -> bool:
    missing = any(report["lost"].values()) or report["filled_ticks"]
    return not (missing or report["unfinished"] or report["damage"])


def template(package: str, name: str) -> jinja2.Template:
    """Load the template ``name`` from the folder ``templates`` of ``package``; it escapes.

    It may import ``table.html.j2``, which draws a `tables.Table`. Data for a script are written
    with the filter ``tojson``, which escapes what would end or hide the script.
    """
    import jinja2  # slow to import

    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(
            [
                jinja2.PackageLoader(package, "templates"),
                jinja2.PackageLoader("space_robot.analysis", "templates"),
            ]
        ),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["zip"] = zip
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    return environment.get_template(name)
