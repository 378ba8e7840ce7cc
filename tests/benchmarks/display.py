"""What a person sees of a benchmark: a table a section."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from space_robot.console.terminal import say, show

from .result import Result


def print_section(title: str, results: Sequence[Result], console: Console) -> None:
    """Print the rows of one section."""
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("", overflow="fold", min_width=18)
    for column in ("median", "spread"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column("beside", overflow="fold")
    table.add_column("times better", justify="right")
    table.add_column("asked", overflow="fold")
    for result in results:
        table.add_row(*cells(result))
    show(table, console)
    for result in results:
        if result.note:
            say(console, f"{result.name}: {result.note}")


def print_machine(machine: dict[str, Any], console: Console) -> None:
    """One line on the machine."""
    build = [name.upper() for name, is_so in machine["python_build"].items() if is_so]
    packages = ", ".join(f"{name} {number}" for name, number in machine["packages"].items())
    say(
        console,
        f"{machine['cpu']}, {machine['cpus_allowed']} of {machine['cpus']} processors, load "
        f"{machine['load_average'][0]:g}; Python {machine['python']} "
        f"({', '.join(build) or 'no PGO, no LTO'}), {packages}",
    )


def cells(result: Result) -> list[str | Text]:
    """The texts of a row."""
    low, high = result.spread
    beside = ""
    if result.beside and result.median_beside is not None:
        beside = f"{result.beside.name}: {_number(result.median_beside)}"
    return [
        result.name,
        f"{_number(result.median)} {result.unit}",
        f"{_number(low)}..{_number(high)}",
        beside,
        f"{result.ratio:.2f}" if result.ratio is not None else "",
        _asked(result),
    ]


def _asked(result: Result) -> Text:
    target = result.target
    if target is None:
        return Text()
    of = "times better " if target.of == "ratio" else ""
    text = f"{of}{result.relation} {target.limit:g}"
    if target.aim is not None:
        text += f" (aim {target.aim:g})"
    if result.reached_aim:
        return Text.assemble(f"{text}: ", ("aim reached", "green"))
    verdict = ("reached", "green") if result.reached else ("missed", "red")
    return Text.assemble(f"{text}: ", verdict)


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"
