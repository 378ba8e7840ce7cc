"""Summary that ``space-robot campaign run`` prints at its end."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rich.console import Console

from ..campaign.flown import FlownCampaign
from ..campaign.report.findings import Findings
from ..campaign.report.tables import TONES, number
from ..campaign.verdicts.laws import quantile
from ..campaign.verdicts.rows import has_values, is_complete, law_rows, laws_in, penalised
from ..console.tables import Column, JudgedCell, Table, named
from ..console.terminal import print_table, say

if TYPE_CHECKING:
    from pandas import DataFrame

SHOWN = ("attitude_angle.rms", "attitude.rms", "joints_4_6.rms", "base_torque.ripple")
"""Metrics whose medians are shown if they were computed; of the attitude in degrees if it is known
so."""


def as_record(flown: FlownCampaign) -> dict[str, Any]:
    """Return the summary of a campaign, ready for JSON."""
    table = flown.table
    return {
        "folder": str(flown.folder),
        "seed": flown.seed,
        "flights": len(table),
        "runs": int(table["run"].nunique()),
        "runs_asked": flown.runs,
        "kept": flown.kept,
        "outcomes": {
            law: law_rows(table, law)["outcome"].value_counts().to_dict() for law in laws_in(table)
        },
        "verdicts": [asdict(verdict) for verdict in flown.verdicts],
    }


def print_summary(flown: FlownCampaign, console: Console) -> None:
    """Print the number of completed flights, medians, verdicts, and next steps."""
    findings = Findings.of(flown)
    names = findings.names
    print_table(medians(flown.table, names, flown.seed, list(flown.study.metrics)), console)
    rows = [
        [
            " ".join(filter(None, (v.id, v.requirement))) + (f", {v.point}" if v.point else ""),
            names[v.law],
            f"{v.met} of {v.runs}",
            v.limits.low,
            JudgedCell("", v.word, TONES[v.word]),
        ]
        for v in findings.verdicts
    ]
    if rows:
        numbers = Column("met in"), Column("at least", spec=".4f"), Column("verdict")
        columns = named("requirement"), named("law"), *numbers
        print_table(Table.of("Requirements", columns, rows), console)
    say(console, shlex.join(["space-robot", "campaign", "report", str(flown.folder)]))
    # where no flight has a number all failed, and the first is as bad as any
    judged = findings.judged
    worst = (findings.worst(findings.whole, judged[0], 1) if judged else flown.table).iloc[0]
    say(console, f"{findings.rerun_command(worst['run'], worst['law'])}    # the worst")
    for warning in findings.flight_warnings:
        say(console, warning)


def medians(table: DataFrame, names: dict[str, str], seed: int, own: Sequence[str] = ()) -> Table:
    """Tabulate the medians of each law; a failed flight ranks below all others.

    Args:
        table: of the campaign.
        names: of the laws in the table.
        seed: of the draws.
        own: names of the user's own metrics.
    """
    shown = [name for name in (*SHOWN, *own) if has_values(table, f"metric.{name}")]
    if SHOWN[0] in shown:
        shown.remove(SHOWN[1])
    rows = []
    for law in laws_in(table):
        own = law_rows(table, law)
        middle = (quantile(penalised(own, f"metric.{name}"), 0.5).value for name in shown)
        rows.append([names[law], f"{is_complete(own).sum()} of {len(own)}", *map(number, middle)])
    columns = (named("law"), Column("complete"), *map(Column, shown))
    return Table.of(f"{table['run'].nunique()} runs, seed {seed}: medians", columns, rows)
