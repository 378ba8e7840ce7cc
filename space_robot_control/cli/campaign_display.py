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
from ..campaign.report.verdict_tables import TONES
from ..campaign.study import Requirement, short_names
from ..flight.ending import COMPLETE
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
            law: rows["outcome"].value_counts().to_dict() for law, rows in _laws(table).items()
        },
        "verdicts": [asdict(verdict) for verdict in flown.verdicts],
    }  # fmt: skip


def print_summary(flown: FlownCampaign, console: Console) -> None:
    """Print how many flights came to their end, medians, verdicts, and how to go on."""
    table, folder = flown.table, shlex.quote(str(flown.folder))
    names = short_names(flown.study.laws)
    print_table(_league(table, names, flown.seed), console)
    if found := flown.verdicts:
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
    run, law = _worst(table, flown.study.require)
    say(console, f"space-robot campaign report {folder}")
    say(
        console,
        f"space-robot campaign rerun {folder} {run} --law {shlex.quote(law)}    # the worst",
    )


def _league(table: DataFrame, names: dict[str, str], seed: int) -> Table:
    shown = [name for name in SHOWN if f"metric.{name}" in table]
    rows = [
        [
            names[law], f"{(own['outcome'] == COMPLETE).sum()} of {len(own)}",
            *(_median(own[f"metric.{name}"]) for name in shown),
        ]
        for law, own in _laws(table).items()
    ]  # fmt: skip
    columns = (
        Column("law", is_label=True), Column("complete"),
        *(Column(name, spec=".3g") for name in shown),
    )  # fmt: skip
    return Table.of(f"{table['run'].nunique()} runs, seed {seed}: medians", columns, rows)


def _median(column: Any) -> float | None:
    known = column.dropna()
    return None if known.empty else float(known.median())


def _laws(table: DataFrame) -> dict[str, DataFrame]:
    """Return the rows of each law."""
    return {law: table[table["law"] == law] for law in table["law"].unique()}


def _worst(table: DataFrame, require: dict[str, Requirement]) -> tuple[int, str]:
    """Find a row that failed, or else the worst by the first requirement, or the first metric."""
    failed = table[table["outcome"] != COMPLETE]
    name, first = next(iter(require.items()), ("", None))
    values = table[f"require.{name}"] if first else table.filter(like="metric.").iloc[:, 0]
    worst = values.idxmin() if first and first.above is not None else values.idxmax()
    row = table.loc[failed.index[0] if len(failed) else worst]
    return int(row["run"]), str(row["law"])
