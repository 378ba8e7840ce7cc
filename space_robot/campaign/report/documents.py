"""A report on a terminal, as Markdown, as a self-contained page, and as data for JSON."""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml
from rich.console import Console

from space_robot.analysis.page import template

from ...analysis.figures.figure_set import Drawing, SavedFigure
from ...analysis.figures.style import save_figure
from ...console.tables import as_markdown
from ...console.terminal import print_table, say
from .figures import drawings
from .findings import Findings
from .tables import sections


def print_report(findings: Findings, console: Console) -> None:
    """Print the tables of a report."""
    for section in sections(findings):
        for table in section.tables:
            print_table(table, console, dense=True)
            say(console, "")


def markdown(findings: Findings) -> str:
    """Return the tables as a Markdown document."""
    tables = [table for section in sections(findings) for table in section.tables]
    return as_markdown(f"Campaign {findings.folder.name}", tables)


def render(findings: Findings) -> str:
    """Render the page; it loads nothing from other files or the network."""
    with TemporaryDirectory() as folder:
        figures = {
            section: [_image(drawing, Path(folder) / "figure") for drawing in own]
            for section, own in drawings(findings).items()
        }
    content = findings.study.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    return template("space_robot.campaign.report", "campaign.html.j2").render(
        name=findings.folder.name,
        flights=len(findings.table),
        sections=[s for s in sections(findings) if s.tables or s.details or s.key in figures],
        figures=figures,
        study=yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=110),
    )


def _image(drawing: Drawing, stem: Path) -> tuple[str, str]:
    """Return caption and data URI; paths are rounded to 0.01 points, which halves their size."""
    (svg,) = save_figure(drawing.draw(), stem, png=False)
    text = svg.read_text("utf-8")
    text = re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]), text)
    svg.write_text(text, "utf-8")
    return drawing.caption, SavedFigure(drawing.caption, svg).data_uri


def record(findings: Findings) -> dict[str, Any]:
    """Return verdicts, leagues, comparisons, sensitivities and the worst runs."""
    table = findings.table
    return {
        "campaign": str(findings.folder),
        "seed": findings.seed,
        "runs": findings.runs,
        "rows": len(table),
        "laws": findings.laws,
        "grid": list(findings.grid),
        "about": dict(findings.about),
        "limits": findings.limits,
        "remarks": findings.remarks,
        "outcomes": {
            law: rows["outcome"].value_counts().to_dict()
            for law, rows in table.groupby("law", sort=False)
        },
        "requirements": [{**plain(v), "share": v.share} for v in findings.verdicts],
        "any_verdict_false_at_most": findings.family_error,
        "leagues": [
            {
                "point": point.point,
                "metric": metric.name,
                "standings": plain(entry.standings),
                "comparisons": [{**plain(c), "finding": c.finding} for c in entry.comparisons],
            }
            for point, metric, entry in findings.leagues
        ],
        "sensitivity": [
            {"point": point.point, "of": quantity.column, **plain(entry)}
            for point, quantity, entry in findings.sensitivities
        ],
        "sobol": plain(findings.sobol),
        "worst": [
            {
                "point": point.point,
                "of": quantity.column,
                **row[["run", "law", "outcome", "reason"]].to_dict(),
                "value": row[quantity.column],
                "command": findings.rerun_command(row["run"], row["law"]),
            }
            for quantity in findings.judged
            for point in findings.points
            for _, row in findings.worst(point, quantity).iterrows()
        ],
    }


def plain(value: Any) -> Any:
    """Convert dataclasses and named tuples to dictionaries, recursively."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return {key: plain(inner) for key, inner in value._asdict().items()}
    return [plain(inner) for inner in value] if isinstance(value, (list, tuple)) else value
