"""Words and tables on a terminal of any width, whatever letters are in them.

What is shown comes from bags and users: nothing in it is markup, and nothing that cannot be
printed reaches the terminal. A table whose numbers do not fit becomes lines.
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
"""Letters of a label's word that tell it from others."""


class _Console(Console):
    def render_str(self, text: str, **options: Any) -> Text:
        """Every text that is shown comes this way, be it a sentence, a title or a cell."""
        return super().render_str("\n".join(map(printable, text.split("\n"))), **options)


def terminal(**options: Any) -> Console:
    """A console that takes every text as it is; ``options``: of `rich.console.Console`."""
    return _Console(markup=False, emoji=False, highlight=False, **options)


def echo_json(report: Any) -> None:
    """Print a report as JSON, which has no NaN and no infinity: they become null."""
    click.echo(json.dumps(_finite(report), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def say(console: Console, text: str) -> None:
    """A sentence in one line, however long: it is the terminal that wraps it."""
    console.print(text, soft_wrap=True)


def show(table: Table, console: Console) -> None:
    """The table, its labels folded where it must be narrow; as lines where numbers would be cut.

    Columns that are justified to the right hold the numbers.
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
    """Return True if no number is wrapped and the start of each label fits."""
    padding = table.padding[1] + table.padding[3]
    longest = (max((len(word) for word in _words(column)), default=0) for column in numbers)
    if sum(length + padding for length in longest) > console.width:  # that is known at once
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
    """Each row's labels, and below them a line for each of its numbers."""
    for line in str(table.title or "").split("\n"):
        if line:
            say(console, _plain(line))
    cells = {id(column): [_plain(cell) for cell in column.cells] for column in table.columns}
    labels = [column for column in table.columns if column not in numbers]
    group = ""
    for row in range(table.row_count):
        first, *others = [cells[id(column)][row] for column in labels] or [""]
        group = first or group  # it stands in the first row of its group only
        if label := " ".join(filter(None, (group, *others))):
            say(console, label)
        for column in numbers:
            if value := cells[id(column)][row]:
                header = _plain(str(column.header).replace("-\n", ""))  # a word in two lines
                say(console, f"  {header}: {value}" if header else f"  {value}")


def _plain(cell: Any) -> str:
    return " ".join((cell.plain if isinstance(cell, Text) else str(cell)).split())
