"""What a person sees of a flight: progress while it lasts, a table at its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

UNITS = {"attitude": "-", "joints": "rad", "base_torque": "N m", "torque": "N m"}

NOTES = {
    "filled_ticks": "ticks without a usable state, shown as the one before",
    "unanswered_ticks": "ticks the controller did not answer in time",
}


def _unit(key: str) -> str:
    return next(unit for prefix, unit in UNITS.items() if key.startswith(prefix))


def print_report(report: dict[str, Any], console: Console) -> None:
    """The RMS and chatter table of a flight."""
    title = (
        f"{report['controller']}, case {report['case']}, gains {report['gains']}: "
        f"{report['ticks']} ticks, {report['duration_s']:g} s"
    )
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
            key, _unit(key), f"{value:{form}}", f"{report['rms']['eq64'][key]:{form}}", *chatter
        )
    console.print(table)
    lost = {topic: count for topic, count in report["lost"].items() if count}
    console.print(f"messages lost: {lost or 'none'}")
    if report["unfinished"]:
        console.print(report["unfinished"])
    for key, words in NOTES.items():
        if report[key]:
            console.print(f"{words}: {report[key]}")


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
        self._progress.console.print(text, highlight=False, markup=False, soft_wrap=True)


@contextmanager
def flight_progress(total_s: float, what: str) -> Iterator[FlightProgress]:
    """A progress line for a flight of ``total_s``."""
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("{task.completed:.1f}/{task.total:.1f} s simulated"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[remark]}"),
    )
    with Progress(*columns, console=console, refresh_per_second=5) as progress:
        yield FlightProgress(progress, total_s, what)


@contextmanager
def counting_progress(what: str) -> Iterator[Callable[[int], Callable[[], None]]]:
    """A progress line for things that are done one by one; see `reproduce` for its use."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TimeElapsedColumn(),
    )
    with ExitStack() as stack:

        def begin(total: int) -> Callable[[], None]:
            console = Console(stderr=True)
            progress = stack.enter_context(
                Progress(*columns, console=console, refresh_per_second=5)
            )
            task = progress.add_task(what, total=total)
            return lambda: progress.advance(task)

        yield begin
