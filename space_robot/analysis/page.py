"""One self-contained HTML page about one flight or several."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import jinja2

from ..console.tables import Column, JudgedCell, Table
from .report_tables import comparison_table, sizing_table
from .words import Report, law_of, notes, remarks


def render(
    reports: Mapping[str, Report],
    descriptions: Mapping[str, dict[str, Any]],
    figures: Sequence[tuple[str, str]],
) -> str:
    """Render the page, without references to anything outside itself.

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
            law_of(report) or "not said",
            *(report[key] or "not said" for key in ("case", "gains", "robot")),
            f"{report['from_s']:g} to {report['to_s']:g} s",
            report["ticks"]
            if report["ticks"] == report["flight_ticks"]
            else f"{report['ticks']} of {report['flight_ticks']}",
            JudgedCell("", *(("whole", "good") if _whole(report) else ("not whole", "bad"))),
        ]
        for name, report in reports.items()
    ]
    return Table.of("", [Column(name) for name in names], rows)


def _whole(report: Report) -> bool:
    """Return whether the bag holds the flight without loss, gap or damage."""
    missing = any(report["lost"].values()) or report["filled_ticks"]
    return not (missing or report["unfinished"] or report["damage"])


def template(package: str, name: str) -> jinja2.Template:
    """Load the template ``name`` from the folder ``templates`` of ``package``; it escapes.

    It may import ``table.html.j2``, which draws a `tables.Table`. Data for a script are written
    with the filter ``tojson``, which escapes what would end or hide the script.
    """
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
