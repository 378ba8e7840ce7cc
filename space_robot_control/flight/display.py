"""What a person sees of a flight: progress while it lasts, a table at its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import groupby
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from ..analysis.table import Line, flown, law_of, lines, notes, remarks, unit_of
from ..terminal import say, show, terminal

LABELS = 44
"""Columns of the terminal that names and units take beside the figures of several bags."""
NARROWEST = 17
"""Columns of one bag."""


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


class FlightProgress:
    """A progress line on standard error; call it with simulated seconds and a remark."""

    def __init__(self, progress: Progress, total_s: float, what: str) -> None:
        self._progress = progress
        self._task = progress.add_task(what, total=total_s, remark="")

    def __call__(self, simulated_s: float, remark: str = "") -> None:
        """Show how far the flight is."""
        self._progress.update(self._task, completed=simulated_s, remark=remark)

    def say(self, text: str) -> None:
        """A line above the progress, which stays."""
        say(self._progress.console, text)


@contextmanager
def flight_progress(total_s: float, what: str) -> Iterator[FlightProgress]:
    """A progress line for a flight of ``total_s``."""
    console = terminal(stderr=True)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        TextColumn("{task.completed:.1f}/{task.total:.1f} s simulated"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[remark]}", markup=False),
    )
    with Progress(*columns, console=console, refresh_per_second=5) as progress:
        yield FlightProgress(progress, total_s, what)


@contextmanager
def counting_progress(what: str) -> Iterator[Callable[[int], Callable[[], None]]]:
    """A progress line for things that are done one by one; see `reproduce` for its use."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TimeElapsedColumn(),
    )
    with ExitStack() as stack:

        def begin(total: int) -> Callable[[], None]:
            console = terminal(stderr=True)
            progress = stack.enter_context(
                Progress(*columns, console=console, refresh_per_second=5)
            )
            task = progress.add_task(what, total=total)
            return lambda: progress.advance(task)

        yield begin
