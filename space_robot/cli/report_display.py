"""Terminal tables of the report on one flight, or on several side by side."""

from __future__ import annotations

import shlex
from itertools import islice
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from ..analysis.report_tables import comparison_table, rms_table, sizing_table
from ..analysis.words import notes, remarks
from ..console.terminal import echo_json, print_table, say, terminal

LABELS = 44
"""Terminal width of names and units beside the metrics of several bags."""
NARROWEST = 17
"""Least terminal width of one bag."""


def show_report(report: dict[str, Any], as_json: bool) -> None:
    """Print the report of a flight on standard output."""
    if as_json:
        echo_json(report)
    else:
        print_table(rms_table(report), console := terminal())
        sizing = report["sizing"]
        if sizing and sizing["requirements"] and (table := sizing_table(report)):
            print_table(table, console)


def show_next_steps(bag: Path) -> None:
    """Print on standard error the commands that can follow for a bag."""
    name = shlex.quote(str(bag))
    click.echo(f"next: space-robot view {name}\n      space-robot analyze {name}", err=True)


def print_comparison(reports: dict[str, dict[str, Any]], console: Console) -> None:
    """Print all metrics of several bags, in as many tables as the width needs."""
    every = max(1, (console.width - LABELS) // NARROWEST)
    remaining = iter(reports.items())
    while shown := dict(islice(remaining, every)):
        print_table(comparison_table(shown), console)
    for name, report in reports.items():
        say(console, f"{name}:")
        for sentence in (*remarks(report), *notes(report)):
            say(console, f"  {sentence}")
