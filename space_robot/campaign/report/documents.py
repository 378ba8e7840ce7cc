"""A report on a terminal, as Markdown, as a self-contained page, and as data for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import yaml
from rich.console import Console

from space_robot.analysis.report import template

from ...analysis.figures.figure_set import Drawing, SavedFigure
from ...analysis.figures.style import save_figure
from ...console.tables import Table, as_markdown
from ...console.terminal import print_table, say
from .figures import drawings
from .findings import CONFIDENCE, Findings
from .tables import (
    choice_tables,
    flown_table,
    influence_tables,
    league_tables,
    outcome_table,
    pair_tables,
    sobol_tables,
    summary_table,
    verdict_grid,
    verdict_notes,
    verdict_table,
    worst_table,
)

SEQUENTIAL = (
    "By a confidence sequence (Robbins 1970; Howard and others 2021): met, if the share of cases "
    "that meet the requirement is above the demanded one with its confidence, at any number of "
    "runs; not met, if it is below; else undecided."
)
FIXED = (
    "By order statistics (Hanson and Beard, NASA/TP-2010-216447): met, if so few runs would miss "
    "the requirement only with the probability that the confidence leaves over, were the share any "
    "smaller; not met, if the same holds of so many; else undecided."
)
COUNTED = (
    "No distribution is assumed. An incomplete flight misses every requirement; one without the "
    "required number is not measured, and counts against every verdict."
)
RANKS = (
    f"A law ranks below another only where the comparison over the same draws shows it with "
    f"{CONFIDENCE:.0%} confidence (sign test and interval of the median ratio, or failures; "
    "corrected over all pairs of a metric after Holm). Quantiles count a failed flight as worse "
    f"than any number; intervals are of {CONFIDENCE:.0%}, each by itself."
)
BEST = (
    "Medians; in brackets the flights that failed, in %. To fly: the laws than which none is "
    f"shown to be better, with {CONFIDENCE:.0%} confidence at each point."
)
PAIRS = (
    "Better in: runs in which the law's number is smaller than the other's in the same draw. p: of "
    "the exact sign test, and of the same test over the runs in which just one of the two failed; "
    "both corrected after Holm."
)
INFLUENCE = (
    "Rank correlation (Spearman): positive if more of the variable makes it worse; with the other "
    "numbers held fixed (partial) where there are enough runs. Spread: the share of the spread of "
    "ranks that the variable explains by itself, whatever the shape (Kruskal and Wallis); p of no "
    f"influence at all, corrected after Holm. Intervals are of {CONFIDENCE:.0%}. Failed flights "
    "rank worst. Where no influence is shown there is no table."
)
SOBOL = (
    "Shares of the metric's variance: what a variable brings by itself (first), and including its "
    f"interactions with others (total); bootstrap intervals of {CONFIDENCE:.0%}."
)


class Section(NamedTuple):
    """A part of a report."""

    key: str
    """``laws``: also of its figures."""
    title: str
    intro: str = ""
    """For the readers of a page."""
    tables: Sequence[Table] = ()
    details: Sequence[Table] = ()
    """Tables of the page only, folded."""


def sections(findings: Findings) -> list[Section]:
    """Return the parts of a report; figures of a page may add to those without tables."""
    has_grid, required = bool(findings.grid), findings.required
    test = FIXED if findings.study.has_fixed_runs else SEQUENTIAL
    in_full = [verdict_table(findings, quantity) for quantity in required]
    if has_grid:
        by_point = [verdict_grid(findings, quantity) for quantity in required]
        laws = _noted(choice_tables(findings), [BEST])
        pairs = _noted(pair_tables(findings), [PAIRS, RANKS])
    else:
        by_point, laws = [], _noted(league_tables(findings), [RANKS])
        pairs = _noted(pair_tables(findings), [PAIRS])
    influences = _noted(influence_tables(findings), [INFLUENCE])
    return [
        Section("findings", "Findings", "", _noted([summary_table(findings)], [])),
        Section("flown", "What was flown", "", [flown_table(findings), outcome_table(findings)]),
        Section(
            "requirements",
            "Requirements",
            f"{test} {COUNTED}" if required else "",
            _noted(by_point or in_full, verdict_notes(findings)),
            in_full if by_point else (),
        ),
        Section("laws", "Laws", "", laws, pairs),
        Section(
            "bands",
            "Over time",
            "The largest norm in each of the bins of time, over all runs. From its end on a flight "
            "that failed counts as worse than any number: where more than 5 % have failed the band "
            "has no upper edge.",
        ),
        Section(
            "distributions",
            "Distributions",
            "A curve that ends below 1 leaves out the flights that failed. Dotted: a requirement's "
            "limit and share.",
        ),
        Section(
            "influences",
            "Influence of the variables",
            "",
            [*([] if has_grid else influences), *_noted(sobol_tables(findings), [SOBOL])],
            influences if has_grid else (),
        ),
        Section(
            "worst",
            "Worst runs",
            "Each command flies a row again, with the same bits, and records a whole bag.",
            [worst_table(findings, findings.whole, quantity) for quantity in findings.judged],
            [
                worst_table(findings, point, quantity, law)
                for quantity in findings.judged
                for point in findings.points
                for law in ([""] if has_grid else findings.laws)
                if has_grid or len(findings.laws) > 1
            ],
        ),
    ]


def _noted(tables: Sequence[Table], notes: Sequence[str]) -> list[Table]:
    tables = [table for table in tables if table.groups[0].rows]
    return [*tables[:-1], *(replace(table, notes=notes) for table in tables[-1:])]


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
    files = save_figure(drawing.draw(), stem, ["svg"])
    return drawing.caption, SavedFigure(drawing.caption, files).data_uri


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
        "warnings": findings.flight_warnings,
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
