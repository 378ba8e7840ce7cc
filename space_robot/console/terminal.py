"""Text and tables on a terminal of any width.

Texts from bags and users are never interpreted as markup, and unprintable characters are
replaced. A table with numbers that do not fit is printed as lines.
"""

from __future__ import annotations

import json
import math
from typing import Any

import click
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from space_robot_msgs_py.config.text import printable

_START = 8
"""Minimum visible characters of a label, to distinguish it from others."""


class _Console(Console):
    def render_str(self, text: str, **options: Any) -> Text:
        """Make all displayed text printable: sentences, titles and cells."""
        return super().render_str("\n".join(map(printable, text.split("\n"))), **options)


def terminal(**options: Any) -> Console:
    """Return a console without markup; ``options`` are those of `rich.console.Console`."""
    return _Console(markup=False, emoji=False, highlight=False, **options)


def echo_json(report: Any) -> None:
    """Print a report as JSON; NaN and infinity become null."""
    click.echo(json.dumps(_finite(report), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def say(console: Console, text: str) -> None:
    """Print a text as one line; the terminal wraps it."""
    console.print(text, soft_wrap=True)


def show(table: Table, console: Console) -> None:
    """Print a table with wrapped labels, or as lines if numbers would be cut.

    Right-justified columns hold the numbers.
    """
    numbers = [column for column in table.columns if column.justify == "right"]
    if not (has_room := _has_room(table, numbers, console)):
        for column in table.columns:
            column.no_wrap = column in numbers
            column.overflow = "fold"
        has_room = _has_room(table, numbers, console)
    if has_room:
        console.print(table)
    else:
        _print_lines(table, numbers, console)


def _has_room(table: Table, numbers: list[Column], console: Console) -> bool:
    """Return True if no number is wrapped and the start of each label is visible."""
    padding = table.padding[1] + table.padding[3]
    longest = (max((len(word) for word in _words(column)), default=0) for column in numbers)
    if sum(length + padding for length in longest) > console.width:  # too wide in any case
        return False
    shown = {
        word
        for line in console.render_lines(table)
        for word in "".join(segment.text for segment in line).split()
    }
    starts = {word[:_START] for word in shown}
    for column in table.columns:
        words = _words(column)
        if column in numbers and not words <= shown:
            return False
        if not {word[:_START] for word in words} <= starts:
            return False
    return True


def _words(column: Column) -> set[str]:
    return {word for cell in column.cells for word in _plain(cell).split()}


def _print_lines(table: Table, numbers: list[Column], console: Console) -> None:
    """Print each row's labels, and below them one line per number."""
    for line in str(table.title or "").split("\n"):
        if line:
            say(console, _plain(line))
    cells = {id(column): [_plain(cell) for cell in column.cells] for column in table.columns}
    labels = [column for column in table.columns if column not in numbers]
    group = ""
    for row in range(table.row_count):
        first, *others = [cells[id(column)][row] for column in labels] or [""]
        group = first or group  # only the first row of a group has it
        if label := " ".join(filter(None, (group, *others))):
            say(console, label)
        for column in numbers:
            if value := cells[id(column)][row]:
                header = _plain(str(column.header).replace("-\n", ""))  # a hyphenated word
                say(console, f"  {header}: {value}" if header else f"  {value}")


def _plain(cell: Any) -> str:
    return " ".join((cell.plain if isinstance(cell, Text) else str(cell)).split())
