"""One self-contained HTML page about one flight or several."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from .table import DEFINITIONS, lines
from .template import template
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
    shown = lines(list(reports.values()))
    groups = {group: [line for line in shown if line.group == group] for group in DEFINITIONS}
    return template("space_robot_control.analysis", "flights.html.j2").render(
        reports=reports,
        laws={name: law_of(report) for name, report in reports.items()},
        groups={group: found for group, found in groups.items() if found},
        definitions=DEFINITIONS,
        notes={name: [*remarks(r), *notes(r)] for name, r in reports.items()},
        whole={name: _whole(report) for name, report in reports.items()},
        descriptions={name: json.dumps(d, indent=1) for name, d in descriptions.items()},
        figures=figures,
    )


def _whole(report: Report) -> bool:
    """Tell whether the bag holds the flight without loss, gap or damage."""
    missing = any(report["lost"].values()) or report["filled_ticks"]
    return not (missing or report["unfinished"] or report["damage"])
