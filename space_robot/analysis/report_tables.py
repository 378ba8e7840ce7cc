"""The tables of a report, or of several: what the terminal and the page both show."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from space_robot_msgs_py.topics import BASE_AXES

from ..console.tables import NONE, Column, Group, JudgedCell, Row, Table, as_latex, named
from .described import IDEAL
from .measure import column_definition, column_label, describe, metric_group
from .series import GROUPS
from .words import Report, analyzed, flown, law_text, notes, remarks, seen_through, with_statistic

IN_RMS_TABLE = ("rms", "rms_eq64", "variation", "chatter", "ripple")
"""Statistics of the table of RMS."""
MAIN = {"rms": "RMS, mean of axes", "max": "maximum", "ripple": "ripple, RMS"}
"""Statistics of the table in LaTeX."""
WIDE = 1e4
"""Torque from which on all torques of a table are written with exponents: of diverged flights."""
OWN_METRICS = "own metrics"


def rms_table(report: Report) -> Table:
    """Tabulate RMS, chatter and ripple of a flight; its remarks stand below.

    Where the truth was recorded, the navigation error stands in the place of (64).
    """
    metrics = report["metrics"]
    title = f"{flown(report)}: {analyzed(report)}"
    if report["truth_recorded"]:
        title += f"\n{seen_through(report)}"
    names = table_v_columns(metrics)
    is_seen = any(f"navigation_{name}.rms" in metrics for name in names)
    second = "navigation_{}.rms" if is_seen else "{}.rms_eq64"
    columns = (
        named(),
        Column("unit"),
        Column("RMS, mean\nof axes"),
        Column("naviga-\ntion RMS" if is_seen else "RMS, eq.\n(64)"),
        Column("variation\nper s", spec=".3g"),
        Column("power >\n100 Hz", spec=".2e"),
        Column("ripple", spec=".2e"),
    )
    torques = {name for name in names if column_definition(name).unit.startswith("N")}
    is_wide = any(metrics[f"{name}.rms"] >= WIDE for name in torques)
    rows: list[list[Any]] = []
    for name in names:
        spec = ".3e" if is_wide or name not in torques else ".4f"
        both = (metrics.get(key.format(name)) for key in ("{}.rms", second))
        rms = ["" if value is None else format(value, spec) for value in both]
        rough = (metrics.get(f"{name}.{key}", "") for key in ("variation", "chatter", "ripple"))
        rows.append([name.removesuffix("_angle"), column_definition(name).unit, *rms, *rough])
    return Table(title, columns, [Group(rows)], remarks(report))


def table_v_columns(metrics: Mapping[str, float]) -> list[str]:
    """Return the columns of errors and torques of Table V; of the attitude that of its angles."""
    return [c for c in with_statistic(metrics, "rms_eq64") if column_definition(c).is_shown]


def metrics_table(report: Report) -> Table:
    """Tabulate what `rms_table` leaves out; below stands why a metric is missing."""
    columns, in_rms_table = (named(), Column()), table_v_columns(report["metrics"])
    shown = [
        name
        for name in shown_names([report])
        if not name.endswith(tuple(f".{key}" for key in IN_RMS_TABLE))
        or name.rpartition(".")[0] not in in_rms_table
    ]
    return Table(
        "further metrics",
        columns,
        [*_groups([report], shown), *_recording([report])],
        notes(report),
    )


def comparison_table(reports: Mapping[str, Report]) -> Table:
    """Tabulate all metrics of several bags, a column each."""
    each = list(reports.values())
    flights: list[list[Any]] = [["controller", *map(law_text, each)]]
    described = ["case", "gains", "robot"]
    if any(report["truth_recorded"] or report["sensors"] != IDEAL for report in each):
        described += ["sensors", "navigation"]
        flights.append(["errors are of", *map(_error_source, each)])
    for key in described:
        flights.append([key, *(report[key] and str(report[key]) for report in each)])
    flights.append(["time (s)", *(f"{r['from_s']:g} to {r['to_s']:g}" for r in each)])
    if any(report["ticks"] < report["flight_ticks"] for report in each):
        flights.append(["share analyzed", *(f"{r['ticks'] / r['flight_ticks']:.1%}" for r in each)])
    columns = named(), *(Column(name) for name in reports)
    groups = _groups(each, shown_names(each))
    return Table(
        "", columns, [Group(flights, "flight"), *groups, *_demand_on_axes(each), *_recording(each)]
    )


def latex_table(reports: Mapping[str, Report], descriptions: Mapping[str, Any]) -> str:
    """Return the main results of flights as LaTeX: errors and torques, a column for each bag.

    ``descriptions``: what was flown, by name of the bag, for the caption.
    """
    each = [report["metrics"] for report in reports.values()]
    names = dict.fromkeys(name for metrics in each for name in table_v_columns(metrics))
    groups = []
    for statistic, title in MAIN.items():
        rows = [
            [column_label(name), column_definition(name).unit.replace(" ", "\u00a0"), *values]
            for name in names
            if any(values := [metrics.get(f"{name}.{statistic}") for metrics in each])
        ]
        groups += [Group(rows, title)] if rows else []
    conditions = [
        f"{name}: {flown(report)}{_friction(descriptions[name])}, sensors {report['sensors']}, "
        f"{report['from_s']:g} to {report['to_s']:g} s"
        for name, report in reports.items()
    ]
    columns = named(), named("unit"), *(Column(name, spec="#.3g") for name in reports)
    return as_latex(Table(f"Errors and torques. {'; '.join(conditions)}.", columns, groups))


def _friction(description: Mapping[str, Any]) -> str:
    if not description.get("friction", True):
        return ", without friction"
    case = description.get("scenario", {}).get("case")
    is_rough = isinstance(case, Mapping) and any(case.get("friction", {}).values())
    return ", friction" if is_rough else ""


def shown_names(reports: Sequence[Report]) -> list[str]:
    """Return the metrics of any report that tables show, in the registry's order."""
    order = list(dict.fromkeys(group.title for group in GROUPS.values()))
    names = dict.fromkeys(name for report in reports for name in report["metrics"])
    shown = [name for name in names if describe(name).is_shown]
    return sorted(shown, key=lambda name: [*order, OWN_METRICS].index(metric_title(name)))


def metric_title(name: str) -> str:
    """Return the title of a metric's group."""
    group = metric_group(name)
    return group.title if group else OWN_METRICS


def number_text(name: str, value: float) -> str:
    """Write the number of a metric as a table shows it."""
    unit = describe(name).unit
    if not np.isfinite(value):
        return "never" if unit == "s" else str(value)
    if unit == "arcsec" and value >= 3600.0:
        return f"{value / 3600.0:.3g} deg"
    return f"{value:.0f}" if unit == "ticks" else f"{value:.4g}"


def _groups(reports: Sequence[Report], names: Sequence[str]) -> list[Group]:
    """Return a row for each name, in groups by title; a group's note has the meanings."""
    groups = []
    for title, own in groupby(names, key=metric_title):
        rows, meanings = [], dict[str, None]()
        for name in own:
            unit, text, *_ = describe(name)
            values = [report["metrics"].get(name) for report in reports]
            texts = [NONE if value is None else number_text(name, value) for value in values]
            rows.append([f"{name} ({unit})" if unit.strip("-") else name, *texts])
            meanings |= {f"{name.rpartition('.')[2] or name}: {text}": None} if text else {}
        groups.append(Group(rows, title, "; ".join(meanings)))
    return groups


def _demand_on_axes(reports: Sequence[Report]) -> list[Group]:
    rows = []
    for key, name in (("peak_torque", "torque (N m)"), ("peak_momentum", "momentum (N m s)")):
        for axis in BASE_AXES:
            each = [report["metrics"].get(f"sizing.{axis}.{key}") for report in reports]
            if any(value is not None for value in each):
                values = (NONE if value is None else f"{value:.4g}" for value in each)
                rows.append([f"{axis} {name}", *values])
    note = "largest torque commanded, and momentum that wheels have to hold for it"
    return [Group(rows, "asked of the base", note)] if rows else []


def _recording(reports: Sequence[Report]) -> list[Group]:
    rows = [
        ["messages lost", *(str(sum(r["lost"].values())) for r in reports)],
        ["states filled in", *(str(r["filled_ticks"]) for r in reports)],
        ["finished", *("no" if r["unfinished"] else "yes" for r in reports)],
        ["damage found", *(str(len(r["damage"])) for r in reports)],
    ]
    return [Group(rows, "recording", "what is missing of the flight or is wrong with the bag")]


def _error_source(report: Report) -> str:
    is_truth = report["truth_recorded"] or report["sensors"] == IDEAL
    return "the truth" if is_truth else "what was measured"


BY_AXIS = (
    ("peak torque", "N m", "peak_torque"),
    ("RMS torque", "N m", "rms_torque"),
    ("angular impulse", "N m s", "angular_impulse"),
    ("stored momentum", "N m s", "peak_momentum"),
    ("pulses", "-", "pulses"),
    ("propellant", "kg", "propellant"),
)
"""Definition, unit and key of what is asked of each axis."""

MANY_TIMES = 10.0
"""Lack, as a share of what a part has, from which on the table has a multiple, not a margin."""


def sizing_table(report: Report) -> Table | None:
    """Tabulate the sizing of a flight; None where it has none."""
    sizing = report["sizing"]
    if sizing is None:
        return None
    requirements = sizing["requirements"]
    parts = groupby(requirements, key=lambda requirement: requirement["part"])
    judged = {(r["part"], r["quantity"]): r for r in requirements}
    groups = [Group(list(_axis_rows(axis, report["metrics"], judged)), axis) for axis in BASE_AXES]
    groups += [
        Group([_row(r["quantity"], r["unit"], r["asked"], r) for r in each], part)
        for part, each in parts
        if part not in BASE_AXES
    ]
    columns = [named(), named("unit"), Column("asked", spec=".4g")]
    columns += [Column("has"), Column("margin")] if requirements else []
    rows = [Group([row[: len(columns)] for row in g.rows], g.name) for g in groups]
    return Table(_title(sizing), columns, rows, _notes(report))


def _axis_rows(
    axis: str, metrics: Mapping[str, float], judged: Mapping[tuple[str, str], Any]
) -> Iterator[Row]:
    for quantity, unit, key in BY_AXIS:
        if (asked := metrics.get(f"sizing.{axis}.{key}")) is not None:
            yield _row(quantity, unit, asked, judged.get((axis, quantity)))


def _row(quantity: str, unit: str, asked: float, judged: dict[str, Any] | None) -> Row:
    if judged is None:
        return quantity, unit, asked, "", ""
    has = "no limit" if judged["has"] is None else f"{judged['has']:.4g}"
    if judged["is_at_limit"]:
        return quantity, unit, asked, has, JudgedCell("", "at the limit", "bad")
    margin = judged["margin"]
    if margin is not None and margin <= -MANY_TIMES:
        return quantity, unit, asked, has, JudgedCell("", f"{1.0 - margin:.3g} times", "bad")
    text = "" if margin is None else f"{100.0 * margin:+.0f} %"
    verdict = JudgedCell.of(judged["is_met"], "has it", "lacks it", text)
    return quantity, unit, asked, has, verdict


def _title(sizing: dict[str, Any]) -> str:
    if not sizing["requirements"]:
        return "what the flight asks of its base"
    who = "had" if sizing["flown"] else "would have"
    return f"what the flight asks of its base, and what actuators {sizing['actuators']} {who}"


def _notes(report: Report) -> list[str]:
    sizing, notes = report["sizing"], []
    if report["metrics"].get("wheels.saturation"):
        notes.append(
            "wheels were at their limits: what the law then asked for is not what the mission "
            "asks; fly ideal actuators for that"
        )
    if not sizing["requirements"] or sizing["flown"]:
        return notes
    parts = {requirement["part"] for requirement in sizing["requirements"]}
    if "thrusters" in parts:
        notes.append("propellant: the least, were thrusters not on or off; pulses: fly them")
    if "wheel_1" in parts:
        notes.append("wheels share what is asked by the pseudo-inverse of their axes")
    return notes
