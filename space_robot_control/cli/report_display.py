"""What a person sees of a flight: progress while it lasts, a table at its end."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from rich.console import Console
from rich.table import Table

from ..analysis.table import Line, lines, unit_of
from ..analysis.words import flown, law_of, notes, remarks
from ..flight.terminal import echo_json, say, show, terminal

LABELS = 44
"""Columns of the terminal that names and units take beside the figures of several bags."""
NARROWEST = 17
"""Columns of one bag."""


def show_report(report: dict[str, Any], as_json: bool) -> None:
    """Print the report of a flight on standard output."""
    if as_json:
        echo_json(report)
    else:
        print_report(report, terminal())


def print_report(report: dict[str, Any], console: Console) -> None:
    """The RMS and chatter table of a flight."""
    title = f"{flown(report)}: {report['ticks']} ticks, {report['duration_s']:g} s"
    table = Table(title=title, title_justify="left")
    table.add_column("")
    for column in ("unit", "RMS, mean of axes", "RMS, eq. (64)"):
        table.add_column(column, justify="right")
    table.add_column("variation per s", justify="right")
    table.add_column("power > 100 Hz", justify="right")
    variation = report["chatter"]["total_variation_per_s"]
    power = report["chatter"]["power_above_100_hz"]
    for key, value in report["rms"]["mean_axis"].items():
        chatter = (f"{variation[key]:.3g}", f"{power[key]:.2e}") if key in variation else ("", "")
        form = ".4f" if "torque" in key else ".3e"
        table.add_row(
            key, unit_of(key), f"{value:{form}}", f"{report['rms']['eq64'][key]:{form}}", *chatter
        )
    show(table, console)
    for remark in remarks(report):
        say(console, remark)


def print_figures(report: dict[str, Any], console: Console) -> None:
    """What `print_report` leaves out: every other figure, and why one is missing."""
    table = Table(title="further figures", title_justify="left")
    for justify in ("left", "left", "right"):
        table.add_column("", justify=justify)
    _fill(table, lines([report], brief=True))
    show(table, console)
    for note in notes(report):
        say(console, note)


def print_comparison(reports: dict[str, dict[str, Any]], console: Console) -> None:
    """All figures of several bags, a column each; in as many tables as the width asks for."""
    every = max(1, (console.width - LABELS) // NARROWEST)
    names = list(reports)
    for first in range(0, len(names), every):
        shown = names[first : first + every]
        table = Table()
        for _ in range(2):
            table.add_column("", no_wrap=True)
        for name in shown:
            table.add_column(name, justify="right", overflow="fold")
        table.add_row("controller", "", *(law_of(reports[name]) or "-" for name in shown))
        for key in ("case", "gains", "robot"):
            table.add_row(key, "", *(str(reports[name][key] or "-") for name in shown))
        span = [f"{reports[name]['from_s']:g} to {reports[name]['to_s']:g}" for name in shown]
        table.add_row("time (s)", "", *span, end_section=True)
        _fill(table, lines([reports[name] for name in shown]))
        show(table, console)
    for name, report in reports.items():
        say(console, f"{name}:")
        for sentence in (*remarks(report), *notes(report)):
            say(console, f"  {sentence}")


def _fill(table: Table, shown: list[Line]) -> None:
    for _, group in groupby(shown, key=lambda line: line.group):
        lines_of_group = list(group)
        for line in lines_of_group:
            table.add_row(
                line.group if line is lines_of_group[0] else "",
                f"{line.name} ({line.unit})" if line.unit else line.name,
                *line.texts,
                end_section=line is lines_of_group[-1],
            )
