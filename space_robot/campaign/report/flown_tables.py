"""Tables of the campaign's definition and of the outcomes of its flights."""

from __future__ import annotations

import json

from ...console.tables import Column, Table
from .findings import Findings


def flown_table(findings: Findings) -> Table:
    """Tabulate file, seed, runs, laws, variables and software versions of the campaign."""
    subject = findings.subject
    study, table = subject.study, subject.table
    scenario = ", ".join(f"{key}: {_short(value)}" for key, value in study.scenario.items())
    rows = [
        ["campaign", str(subject.folder)],
        ["scenario", scenario or "all as by default"],
        ["laws", ", ".join(study.laws)],
        ["seed", str(subject.seed)],
        ["runs", f"{table['run'].nunique()} of {subject.runs} under every law"],
        ["design", study.design],
        *([f"varied: {name}", _short(value)] for name, value in study.vary.items()),
        *([name, text] for name, text in subject.about.items()),
    ]
    return Table.of("What was flown", [Column(is_label=True), Column(is_label=True)], rows)


def outcome_table(findings: Findings) -> Table:
    """Tabulate how the flights of each law ended."""
    table = findings.subject.table
    outcomes = [str(outcome) for outcome in table["outcome"].unique()]
    outcomes.sort(key=lambda outcome: (outcome != "complete", outcome))
    counts = table.groupby(["law", "outcome"]).size()
    rows = [
        [findings.names[law], *(str(int(counts.get((law, outcome), 0))) for outcome in outcomes)]
        for law in findings.laws
    ]
    columns = [Column("law", is_label=True), *map(Column, outcomes)]
    return Table.of("How the flights ended", columns, rows)


def _short(value: object) -> str:
    """Return a value of the file as one line."""
    if isinstance(value, str):
        return value
    text = json.dumps(value, default=str).replace('"', "")
    return text if len(text) <= 160 else text[:157] + "..."
