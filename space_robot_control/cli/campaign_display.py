"""What ``space-robot campaign run`` says at its end."""

from __future__ import annotations

import shlex
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rich.console import Console

from ..analysis.tables import Column, Table
from ..analysis.tables import Verdict as Judged
from ..analysis.terminal import print_table
from ..campaign.flown import FlownCampaign
from ..campaign.report.findings import Findings
from ..campaign.report.subject import subject_of
from ..campaign.report.verdict_tables import TONES, command
from ..campaign.verdicts.values import ended, laws_of, of_law
from ..flight.terminal import say

if TYPE_CHECKING:
    from pandas import DataFrame

SHOWN = ("attitude_rms", "joints_4_6_rms", "ripple_base_torque")
"""Metrics whose medians are shown, of those that there are."""


def as_record(flown: FlownCampaign) -> dict[str, Any]:
    """Return what there is to say of a campaign, ready for JSON."""
    table = flown.table
    return {
        "folder": str(flown.folder), "seed": flown.seed, "flights": len(table),
        "runs": int(table["run"].nunique()), "runs_asked": flown.runs, "kept": flown.kept,
        "outcomes": {
            law: of_law(table, law)["outcome"].value_counts().to_dict() for law in laws_of(table)
        },
        "verdicts": [asdict(verdict) for verdict in flown.verdicts],
    }  # fmt: skip


def print_summary(flown: FlownCampaign, console: Console) -> None:
    """Print how many flights came to their end, medians, verdicts, and how to go on."""
    findings = Findings(subject_of(flown))
    names = findings.names
    print_table(_league(flown.table, names, flown.seed), console)
    if found := findings.verdicts:
        print_table(
            Table.of(
                "Requirements",
                (
                    Column("requirement", is_label=True), Column("law", is_label=True),
                    Column("met in"), Column("at least", spec=".4f"), Column("verdict"),
                ),
                [
                    [
                        f"{v.requirement}, {v.point}" if v.point else v.requirement,
                        names[v.law], f"{v.runs - v.failures} of {v.runs}", v.limits.low,
                        Judged("", v.word, TONES[v.word]),
                    ]
                    for v in found
                ],
            ),
            console,
        )  # fmt: skip
    say(console, shlex.join(["space-robot", "campaign", "report", str(flown.folder)]))
    # where no flight has a number all failed, and the first is as bad as any
    driven = findings.driven
    rows = findings.worst(findings.whole, driven[0], 1) if driven else flown.table
    again = command(flown.folder, int(rows["run"].iloc[0]), rows["law"].iloc[0])
    say(console, f"{again}    # the worst")


def _league(table: DataFrame, names: dict[str, str], seed: int) -> Table:
    shown = [name for name in SHOWN if f"metric.{name}" in table]
    rows = []
    for law in laws_of(table):
        own = of_law(table, law)
        medians = (_median(own[f"metric.{name}"]) for name in shown)
        rows.append([names[law], f"{ended(own).sum()} of {len(own)}", *medians])
    columns = (
        Column("law", is_label=True), Column("complete"),
        *(Column(name, spec=".3g") for name in shown),
    )  # fmt: skip
    return Table.of(f"{table['run'].nunique()} runs, seed {seed}: medians", columns, rows)


def _median(column: Any) -> float | None:
    known = column.dropna()
    return None if known.empty else float(known.median())
