"""Self-contained HTML page of a campaign."""

from __future__ import annotations

import re
from pathlib import Path
from tempfile import TemporaryDirectory

from ...analysis.figures.figure_set import SavedFigure
from ...analysis.figures.style import save_figure
from ...analysis.page import template
from ...console.tables import Table
from .figures import drawings
from .findings import Findings
from .flown_tables import flown_table, outcome_table
from .league_tables import RANKS, choice_tables, league_table, pair_table
from .sensitivity_tables import sensitivity_table, sobol_table
from .verdict_tables import TONES, demanded, method, verdict_grid, verdict_table, worst_table


def render(findings: Findings) -> str:
    """Render the page; it loads nothing from other files or the network."""
    figures: dict[str, list[tuple[str, str]]] = {}
    with TemporaryDirectory() as folder:
        for number, drawing in enumerate(drawings(findings)):
            (svg,) = save_figure(drawing.draw(), Path(folder) / str(number), png=False)
            svg.write_text(lean(svg.read_text("utf-8")), "utf-8")
            uri = SavedFigure(drawing.caption, svg).data_uri
            figures.setdefault(drawing.section, []).append((drawing.caption, uri))
    has_grid = bool(findings.grid)
    return template("space_robot.campaign.report", "campaign.html.j2").render(
        name=findings.subject.folder.name,
        flights=len(findings.subject.table),
        flown=flown_table(findings),
        outcomes=outcome_table(findings),
        remarks=findings.remarks,
        summaries=_summaries(findings),
        method=method(findings),
        verdicts=verdict_table(findings) if findings.required else None,
        verdict_grids=[verdict_grid(findings, q) for q in findings.required] if has_grid else [],
        league=choice_tables(findings) if has_grid else [league_table(findings)],
        ranks=RANKS if has_grid else "",
        pairs=pair_table(findings),
        sensitivity=sensitivity_table(findings) if findings.sensitivities else None,
        sobol=sobol_table(findings.sobol) if findings.sobol else None,
        worst=_worst(findings),
        text=findings.subject.text,
        figures=figures,
    )


def lean(svg: str) -> str:
    """Round the numbers of an SVG's paths to 0.01 points, which halves its size."""
    return re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]), svg)


def _summaries(findings: Findings) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the text of each requirement, and the laws by verdict, with their colours."""
    summaries = []
    for quantity in findings.required:
        own = [v for v in findings.verdicts if v.requirement == quantity.name]
        words = []
        for word in TONES:
            named = [
                f"{findings.names[v.law]} ({v.point})" if v.point else findings.names[v.law]
                for v in own
                if v.word == word
            ]
            if named:
                words.append((f"{word} {_counted(named)}", TONES[word]))
        summaries.append((f"{quantity.name}, {demanded(quantity)}", words))
    return summaries


def _counted(names: list[str]) -> str:
    """Return the list of names, or their number if there are many."""
    return f"under {', '.join(names)}" if len(names) <= 8 else f"{len(names)} times"


def _worst(findings: Findings) -> list[tuple[Table, list[Table]]]:
    """Return the worst runs of all laws, and without a grid also those of each law."""
    rows = []
    for quantity in findings.driven:
        for part in findings.parts:
            each = []
            if len(findings.parts) == 1 and len(findings.laws) > 1:
                each = [worst_table(findings, part, quantity, law=law) for law in findings.laws]
            rows.append((worst_table(findings, part, quantity), each))
    return rows
